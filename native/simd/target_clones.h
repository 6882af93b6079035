// Functions compiled for several instruction sets, the best chosen at run time. Without contraction to fused multiply-add
// the results are the same for all.
#pragma once

#define BEAMSPREAD_CLONES __attribute__((target_clones("default", "avx2", "avx512f")))
