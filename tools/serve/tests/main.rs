//! The server, and the clients and viewers that it meets.

mod clients;
mod viewer;
mod viewers;
