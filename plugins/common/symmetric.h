/* SPDX-License-Identifier: MIT */
/* symmetric - a symmetric tensor by value, and the one place that knows in which order a SYMMETRIC field keeps its
 * components. In 2-D zz, yz and xz stay zero, and `dim` is a constant where it matters. */
#pragma once
#include <quern/vec.h>

typedef struct symmetric {
	quern_real xx, yy, zz, xy, yz, xz;
} symmetric;

/* Entry i of the columns; macros for the reason given in quern/vec.h. */
#define SYMMETRIC_AT(columns, i, dim)                                                                        \
	((symmetric) { (columns)[0][i], (columns)[1][i], (dim) == 3 ? (columns)[2][i] : 0,                       \
		(columns)[(dim) == 3 ? 3 : 2][i], (dim) == 3 ? (columns)[4][i] : 0,                                  \
		(dim) == 3 ? (columns)[5][i] : 0 })
#define SYMMETRIC_DO(columns, i, to, s, dim)                                                                 \
	do {                                                                                                     \
		(columns)[0][i] to(s).xx;                                                                            \
		(columns)[1][i] to(s).yy;                                                                            \
		(columns)[(dim) == 3 ? 3 : 2][i] to(s).xy;                                                           \
		if ((dim) == 3) {                                                                                    \
			(columns)[2][i] to(s).zz;                                                                        \
			(columns)[4][i] to(s).yz;                                                                        \
			(columns)[5][i] to(s).xz;                                                                        \
		}                                                                                                    \
	} while (0)
#define SYMMETRIC_PUT(columns, i, s, dim) SYMMETRIC_DO(columns, i, =, s, dim)
#define SYMMETRIC_ADD(columns, i, s, dim) SYMMETRIC_DO(columns, i, +=, s, dim)

/* w (a b + b a)/2 */
QUERN_INLINE symmetric symmetric_dyad(quern_real w, quern_vec a, quern_vec b) {
	const quern_real half = 0.5 * w;
	return (symmetric) { w * a.x * b.x, w * a.y * b.y, w * a.z * b.z, half * (a.x * b.y + a.y * b.x),
		half * (a.y * b.z + a.z * b.y), half * (a.x * b.z + a.z * b.x) };
}
