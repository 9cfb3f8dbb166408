//! Numbers as bytes.

/// A number that travels between ranks.
pub trait Number: Copy + Default {
    /// Its bytes.
    const SIZE: usize;

    /// Writes it to `SIZE` bytes.
    fn write(self, bytes: &mut [u8]);

    /// Reads it from `SIZE` bytes.
    fn read(bytes: &[u8]) -> Self;
}

macro_rules! number {
    ($($type:ty),*) => {$(
        impl Number for $type {
            const SIZE: usize = size_of::<$type>();

            fn write(self, bytes: &mut [u8]) {
                bytes.copy_from_slice(&self.to_le_bytes());
            }

            fn read(bytes: &[u8]) -> Self {
                let mut own = [0; size_of::<$type>()];
                own.copy_from_slice(bytes);
                Self::from_le_bytes(own)
            }
        }
    )*};
}

number!(f32, f64, u64);

/// All numbers, one after the other, in `bytes`, whose length is changed to fit.
pub fn write_all<T: Number>(numbers: &[T], bytes: &mut Vec<u8>) {
    bytes.resize(numbers.len() * T::SIZE, 0);
    numbers.iter().zip(bytes.chunks_exact_mut(T::SIZE)).for_each(|(number, bytes)| number.write(bytes));
}

/// As many numbers as there are bytes for.
pub fn read_all<T: Number>(bytes: &[u8]) -> impl Iterator<Item = T> {
    bytes.chunks_exact(T::SIZE).map(T::read)
}
