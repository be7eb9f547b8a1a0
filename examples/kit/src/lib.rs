//! What the examples share: an in-process bus, small matrices, pictures, tables, random numbers, and checks of what a design promises.

pub mod bus;
pub mod checks;
pub mod matrix;
pub mod plot;
pub mod random;
pub mod sets;
pub mod table;
pub mod trajectory;
