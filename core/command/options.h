/* SPDX-License-Identifier: MIT */
/* options - a command line, read alike by every command
 *
 * GNU style: --name value and --name=value, -n value, options and words in any order, -- before words that begin with a
 * dash, -h and --help everywhere. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

typedef struct quern_command quern_command;

/* What an option that may stand several times was given, NULL-terminated; free(at). */
typedef struct quern_texts {
	const char **at;
	size_t n, capacity;
} quern_texts;

/* One of flag, text, texts and number takes what is given. */
typedef struct quern_option {
	const char *name, *value, *help; /* "threads", "N" (NULL: a flag), "worker threads" */
	char letter;                     /* 'o': -o as well; 0: none */
	bool *flag;
	const char **text; /* never empty */
	quern_texts *texts;
	int64_t *number, least, most; /* digits alone, with a '-' before them if `least` is negative */
} quern_option;

enum { QUERN_WORDS = 2 };

#define QUERN_FLAG(to, name_, help_)                                                                         \
	{ .flag = to, .name = name_, .help = help_ }
#define QUERN_TEXT(to, letter_, name_, value_, help_)                                                        \
	{ .text = to, .letter = letter_, .name = name_, .value = value_, .help = help_ }
#define QUERN_TEXTS(to, name_, value_, help_)                                                                \
	{ .texts = to, .name = name_, .value = value_, .help = help_ }
#define QUERN_NUMBER(to, name_, least_, most_, help_)                                                        \
	{ .number = to, .name = name_, .value = "N", .help = help_, .least = least_, .most = most_ }
#define QUERN_END_OPTIONS                                                                                    \
	{ .name = NULL }

/* What stands beside the options; `missing` says what is when there are less than `least`. */
typedef struct quern_words {
	const char *missing;
	size_t least, most, n;
	const char *at[QUERN_WORDS];
} quern_words;

enum { QUERN_OPTIONS_READ = -1 };

/* QUERN_OPTIONS_READ if the command may begin, else the status to end with: usage was printed because it was asked for,
 * or one sentence says what is wrong. `options` end with QUERN_END_OPTIONS. */
int quern_options_read(
	const quern_command *, const quern_option *options, quern_words *, int argc, char **argv);
