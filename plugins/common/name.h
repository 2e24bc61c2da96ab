/* SPDX-License-Identifier: MIT */
/* name - what a scene may call its things */
#pragma once
#include <quern/abi.h>

enum { LONGEST_NAME = 40 };

/* Letters, digits and '_', beginning with a letter, at most LONGEST_NAME of them. */
static inline bool quern_name_is_good(const char *name) {
	uint32_t n = 0;
	for (; name[n]; n++) {
		const bool letter = (name[n] >= 'a' && name[n] <= 'z') || (name[n] >= 'A' && name[n] <= 'Z');
		if (n == LONGEST_NAME || !(letter || (n && (name[n] == '_' || (name[n] >= '0' && name[n] <= '9')))))
			return false;
	}
	return n > 0;
}
