//! Compiling one function for several widths of vector registers and choosing at run time.

use std::sync::atomic::{AtomicU8, Ordering};

/// Width of the vector registers in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Width {
    /// What every processor has.
    Plain = 1,
    /// AVX2 with fused multiply-add: 4 numbers.
    Avx2 = 2,
    /// AVX-512: 8 numbers.
    Avx512 = 3,
}

static CHOSEN: AtomicU8 = AtomicU8::new(0);

fn detect() -> Width {
    #[cfg(target_arch = "x86_64")]
    {
        if std::is_x86_feature_detected!("avx512f") && std::is_x86_feature_detected!("avx512dq") {
            return Width::Avx512;
        }
        if std::is_x86_feature_detected!("avx2") && std::is_x86_feature_detected!("fma") {
            return Width::Avx2;
        }
    }
    Width::Plain
}

/// The width in use: the widest that this processor has, unless [`limit`] asked for less.
#[must_use]
pub fn width() -> Width {
    match CHOSEN.load(Ordering::Relaxed) {
        1 => Width::Plain,
        2 => Width::Avx2,
        3 => Width::Avx512,
        _ => {
            let width = detect();
            CHOSEN.store(width as u8, Ordering::Relaxed);
            width
        }
    }
}

/// Uses at most the given width from now on; for tests and measurements.
pub fn limit(width: Width) {
    let detected = detect();
    let chosen = if (width as u8) < (detected as u8) { width } else { detected };
    CHOSEN.store(chosen as u8, Ordering::Relaxed);
}

/// Work that is worth compiling for every width.
pub trait Kernel: Sized {
    /// What it gives.
    type Output;
    /// Does it; must be inlined into its callers (`#[inline(always)]`).
    fn run(self) -> Self::Output;

    // Methods of the kernel, because the compiler translates these in the module of its type. Functions that take kernels would
    // all be translated here, one after the other.

    /// [`Kernel::run`] with AVX-512.
    ///
    /// # Safety
    /// The processor has it.
    #[cfg(all(target_arch = "x86_64", not(debug_assertions)))]
    #[allow(unsafe_code)]
    #[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
    unsafe fn avx512(self) -> Self::Output {
        self.run()
    }

    /// [`Kernel::run`] with AVX2.
    ///
    /// # Safety
    /// The processor has it.
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    #[target_feature(enable = "avx2,fma")]
    unsafe fn avx2(self) -> Self::Output {
        self.run()
    }
}

/// Runs a kernel compiled for the width in use.
pub fn dispatch<K: Kernel>(kernel: K) -> K::Output {
    #[cfg(target_arch = "x86_64")]
    #[allow(unsafe_code)]
    match width() {
        // SAFETY: `width` gives only what this processor has. Builds for tests of the core leave it out, which saves a third of
        // their time; the tests of the package run with every width.
        #[cfg(not(debug_assertions))]
        Width::Avx512 => return unsafe { kernel.avx512() },
        Width::Plain => {}
        // SAFETY: as above.
        _ => return unsafe { kernel.avx2() },
    }
    kernel.run()
}
