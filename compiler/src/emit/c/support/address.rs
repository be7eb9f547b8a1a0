//! What C passes by address. Everything that is not safe is here.
//!
//! An address that is NULL or not aligned is refused. Of any other, a caller promises what the header asks: that it leads to as many
//! numbers as it says, that these may be read or written, and that nobody else writes a controller meanwhile. Numbers are copied
//! in before anything is written, so that an output may stand in the place of an input.
#![allow(unused, reason = "a network uses the part that it needs")]

use core::ffi::c_void;
use core::marker::PhantomData;

use crate::codes::Refusal;

/// A value to read.
#[repr(transparent)]
pub struct In<T>(*const c_void, PhantomData<T>);

/// A value to write; nothing is read there.
#[repr(transparent)]
pub struct Out<T>(*mut c_void, PhantomData<T>);

/// The first of several values to read; NULL where there are none.
#[repr(transparent)]
pub struct Many<T>(*const c_void, PhantomData<T>);

/// A structure of the header, for a [`Held`] T.
#[repr(transparent)]
pub struct Place<T>(*mut c_void, PhantomData<T>);

/// What a structure of the header holds: a number that tells it from memory that holds anything else comes first.
#[repr(C)]
pub struct Held<T> {
    tag: u64,
    value: T,
}

/// What may be held.
pub trait Tagged {
    /// No two types have the same.
    const TAG: u64;
}

/// Where something may be written.
pub struct Ready<T>(*mut T);

impl<T: Tagged> Held<T> {
    pub const fn new(value: T) -> Self {
        Self { tag: T::TAG, value }
    }
}

impl<T> In<T> {
    pub fn get(self) -> Result<T, Refusal>
    where
        T: Copy,
    {
        let address = aligned(self.0.cast::<T>())?;
        // SAFETY: not NULL, aligned, and by the caller's promise a T, which is plain numbers.
        Ok(unsafe { address.read() })
    }
}

impl<T> Out<T> {
    pub fn ready(self) -> Result<Ready<T>, Refusal> {
        aligned(self.0.cast::<T>()).map(|_| Ready(self.0.cast()))
    }

    /// `None` for NULL: the value is not wanted.
    pub fn wanted(self) -> Result<Option<Ready<T>>, Refusal> {
        if self.0.is_null() { Ok(None) } else { self.ready().map(Some) }
    }
}

impl<T: Copy> Ready<T> {
    pub fn put(self, value: T) {
        // SAFETY: not NULL, aligned, and by the caller's promise room for a T.
        unsafe { self.0.write(value) }
    }
}

impl<T> Ready<T> {
    /// Writes the values one after the other, no more than `count`.
    pub fn put_all<'a>(self, count: usize, values: impl Iterator<Item = &'a T>)
    where
        T: Copy + 'a,
    {
        for (k, value) in values.take(count).enumerate() {
            // SAFETY: not NULL, aligned, and by the caller's promise room for `count` values.
            unsafe { self.0.add(k).write(*value) }
        }
    }
}

impl<T> Many<T> {
    /// For as long as the caller has promised to leave them where they are.
    pub fn get<'a>(self, count: usize) -> Result<&'a [T], Refusal> {
        if count == 0 {
            return Ok(&[]);
        }
        let address = aligned(self.0.cast::<T>())?;
        if count > isize::MAX as usize / size_of::<T>().max(1) {
            return Err(Refusal::LENGTH);
        }
        // SAFETY: not NULL, aligned, no larger than memory, and by the caller's promise `count` plain values that nobody writes.
        Ok(unsafe { core::slice::from_raw_parts(address, count) })
    }
}

impl<T: Tagged> Place<T> {
    /// Whether a structure of `size` bytes, as the header has it in whole words of 64 bits, is one for a T.
    pub fn fits(&self, size: usize) -> Result<Ready<Held<T>>, Refusal> {
        const { assert!(align_of::<Held<T>>() <= align_of::<u64>(), "the header has words of 64 bits") };
        let address = aligned(self.0.cast::<Held<T>>())?;
        if size.div_ceil(8) == size_of::<Held<T>>().div_ceil(8) { Ok(Ready(address.cast_mut())) } else { Err(Refusal::SIZE) }
    }

    pub fn get<'a>(self) -> Result<&'a mut T, Refusal> {
        let address = started(self.0.cast::<Held<T>>())?;
        // SAFETY: not NULL, aligned, and begins as only `Ready::make` has it begin. That one thread at a time uses it is the
        // caller's promise.
        Ok(unsafe { &mut (*address.cast_mut()).value })
    }

    /// For reading only, and for as long as the caller has promised to leave it where it is.
    pub fn look<'a>(self) -> Result<&'a T, Refusal> {
        let address = started(self.0.cast::<Held<T>>())?;
        // SAFETY: as for `get`.
        Ok(unsafe { &(*address).value })
    }
}

impl<T: Tagged> Ready<Held<T>> {
    /// Makes the structure one that holds a T; whatever it held before is forgotten.
    pub fn make(self, value: T) {
        // SAFETY: not NULL, aligned, and large enough, as `Place::fits` has found.
        unsafe { self.0.write(Held::new(value)) }
    }
}

fn aligned<T>(address: *const T) -> Result<*const T, Refusal> {
    match address {
        address if address.is_null() => Err(Refusal::NULL),
        address if !address.is_aligned() => Err(Refusal::MISALIGNED),
        address => Ok(address),
    }
}

fn started<T: Tagged>(address: *const Held<T>) -> Result<*const Held<T>, Refusal> {
    let tag = aligned(address)?.cast::<u64>();
    // SAFETY: not NULL, aligned, and by the caller's promise a structure of the header, all of which begin with such a number.
    if unsafe { tag.read() } == T::TAG { Ok(address) } else { Err(Refusal::NOT_STARTED) }
}
