//! Files at the edge: writing one whole or not at all, reading no more than a limit, and paths as
//! text.

mod path_text;
mod read;
mod write;

pub use path_text::{path_of, text_of};
pub use read::{read_at_most, read_text_at_most};
pub use write::{TEMPORARY, check_writable, is_for_a_file, write_durable, write_new, write_whole};
