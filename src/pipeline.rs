//! `compile()`: every stage, in order.
