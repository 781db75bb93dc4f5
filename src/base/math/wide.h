// RUEDO_WIDE: a function of innermost loops, compiled for wider registers, too, where the processor
// has them. The compiler contracts nothing to FMA, so the bits are the same.
#pragma once

#if defined(__x86_64__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define RUEDO_WIDE [[gnu::target_clones("default", "avx2")]]
#else
#define RUEDO_WIDE
#endif
