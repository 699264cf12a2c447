//! Every reader on small snippets, good and bad; what dead reckoning says of its own error; bytes at random.

mod alignment;
mod bytes;
mod csv;
mod g2o;
mod graphs;
mod honesty;
mod mrclam;
