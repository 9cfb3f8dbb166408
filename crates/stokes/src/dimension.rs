//! Compiling the solvers once.
//!
//! Code that is generic in the dimension is compiled in every crate that uses it. What is made by functions
//! that are not generic is compiled here, in 2D and in 3D, and others get it behind a trait.

use std::any::Any;

/// What `in_2d` or `in_3d` makes, whichever makes a `T`.
pub fn in_dimension<T: 'static, T2: 'static, T3: 'static>(
    in_2d: impl FnOnce() -> T2,
    in_3d: impl FnOnce() -> T3,
) -> T {
    let of_type: &dyn Any = &std::marker::PhantomData::<T>;
    let made: Box<dyn Any> = match of_type.is::<std::marker::PhantomData<T2>>() {
        true => Box::new(in_2d()),
        false => Box::new(in_3d()),
    };
    *made.downcast::<T>().expect("there are two dimensions")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_type_tells_the_dimension() {
        let made = || -> [f64; 3] { in_dimension(|| [2.0; 2], || [3.0; 3]) };
        assert_eq!(made(), [3.0; 3]);
        let made: [f64; 2] = in_dimension(|| [2.0; 2], || [3.0; 3]);
        assert_eq!(made, [2.0; 2]);
    }
}
