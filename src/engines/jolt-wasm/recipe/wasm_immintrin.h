// What Jolt writes for x86's vector instructions, in WebAssembly's: SIMDe has each of them as wasm_simd128.
#pragma once

#define SIMDE_ENABLE_NATIVE_ALIASES
#define SIMDE_FLOAT16_API SIMDE_FLOAT16_API_PORTABLE  // the compiler has no half floats for this target
#include <simde/x86/sse4.2.h>
