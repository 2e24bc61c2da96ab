/* SPDX-License-Identifier: MIT */
/* templates - the files that `quern new` writes, made from core/templates when the program is built */
#pragma once

typedef struct quern_template {
	const char *name;         /* "contact.c", "README.md.txt" */
	const char *const *lines; /* without their ends, NULL-terminated */
} quern_template;

extern const quern_template quern_templates[]; /* ends with a NULL name */
