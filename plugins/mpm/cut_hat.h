/* SPDX-License-Identifier: MIT */
/* cut_hat - how much of a hat, and of one that is averaged over a box, lies beyond a place. docs/theory/mpm.md, section 3 */
#pragma once
#include <math.h>
#include <quern/abi.h>

/* Over all of it; `from`: cells from its node on, negative before it. */
static inline quern_real cut_hat_beyond(quern_real from) {
	const quern_real left = 1 - fmin(fabs(from), 1), tail = 0.5 * left * left;
	return from < 0 ? 1 - tail : tail;
}

/* Of a hat averaged over 2 l; t >= 0. */
static inline quern_real cut_hat_tail(quern_real l, quern_real t) {
	const quern_real left = 1 + l - t;
	if (t >= 1 + l) return 0;
	if (t >= 1 - l) return left * left * left / (12 * l);
	if (t >= l) return 0.5 * (1 - t) * (1 - t) + l * l / 6;
	return 0.5 - t + t * t * t / (6 * l) + 0.5 * l * t;
}

static inline quern_real cut_hat_averaged(quern_real l, quern_real from) {
	return from < 0 ? 1 - cut_hat_tail(l, -from) : cut_hat_tail(l, from);
}

/* The same of the node on a wall (0) and of the next one (1), where what is outside is folded back: nearer to the wall than l they have 1 - y and y. */
static inline quern_real cut_hat_folded(quern_real l, int32_t to_wall, quern_real from) {
	const quern_real y = fmax(from + to_wall, 0), more = l * l / 6;
	if (y >= l) return cut_hat_averaged(l, from);
	return to_wall ? 1 - more - 0.5 * y * y : 0.5 + more - y * (1 - 0.5 * y);
}
