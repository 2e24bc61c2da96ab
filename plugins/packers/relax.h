/* SPDX-License-Identifier: MIT */
/* relax - grains that grow together and push each other apart. docs/theory/packers.md, section 7 */
#pragma once
#include <quern/packer.h>

/* Radii grow evenly in so many sweeps; then sweeps go on until no overlap is above `overlap` of the smaller radius, at most ten times as
 * many, and after that grains are taken away. QUERN_E_MEMORY if memory is gone. */
quern_status quern_packer_relax(quern_relax_job *, int32_t sweeps, quern_real overlap);
