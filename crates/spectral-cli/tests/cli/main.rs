//! The program as a user meets it: one module per group of subcommands, and one for command lines that make no sense.

mod bake;
mod inspect;
mod matrices;
mod pond;
mod program;
mod prt;
mod render;
mod usage;
mod view;
