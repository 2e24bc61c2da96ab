/* SPDX-License-Identifier: MIT */
#include "options.h"
#include "command.h"
#include "text.h"
#include <errno.h>
#include <getopt.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { MOST_OPTIONS = 16, FIRST_LONG = 256 }; /* what getopt_long returns for option k: FIRST_LONG + k */

static size_t count(const quern_option *options) {
	size_t n = 0;
	while (options[n].name && n < MOST_OPTIONS) n++;
	return n;
}

/* getopt's own two tables; --help comes behind the command's options. */
static void describe(const quern_option *options, struct option *table, char *letters) {
	const size_t n = count(options);
	*letters++ = ':';
	for (size_t k = 0; k < n; k++) {
		table[k] = (struct option) { options[k].name, options[k].value ? required_argument : no_argument,
			NULL, FIRST_LONG + (int)k };
		if (!options[k].letter) continue;
		*letters++ = options[k].letter;
		if (options[k].value) *letters++ = ':';
	}
	table[n] = (struct option) { "help", no_argument, NULL, 'h' };
	table[n + 1] = (struct option) { 0 };
	memcpy(letters, "h", 2);
}

static const quern_option *option_of(const quern_option *options, int code) {
	for (const quern_option *o = options; o->name; o++)
		if (code == FIRST_LONG + (int)(o - options) || (o->letter && code == o->letter)) return o;
	return NULL;
}

static int help(const quern_command *command, const quern_option *options) {
	quern_print_usage(command, stdout);
	printf("\n\n");
	for (const quern_option *o = options; o->name; o++) {
		const char short_form[] = { '-', o->letter, ',', ' ', 0 };
		char *form = quern_format("%s--%s%s%s", o->letter ? short_form : "    ", o->name, o->value ? " " : "",
			o->value ? o->value : "");
		printf("  %-30s %s\n", form, o->help);
		free(form);
	}
	printf("  %-30s %s\n", "-h, --help", "this text");
	return QUERN_EXIT_DONE;
}

/* ---- values ---- */

static bool is_whole(const char *text, bool negative) {
	if (negative && *text == '-') {
		if (text[1] == '0') return false; /* 0 has one form */
		text++;
	}
	const size_t n = strspn(text, "0123456789");
	return n && !text[n] && (*text != '0' || n == 1);
}

static int take_number(const quern_command *command, const quern_option *o, const char *text) {
	errno = 0;
	const bool whole = is_whole(text, o->least < 0);
	const int64_t value = whole ? strtoll(text, NULL, 10) : 0;
	if (whole && !errno && value >= o->least && value <= o->most)
		return *o->number = value, QUERN_OPTIONS_READ;
	char range[64] = "";
	if (o->most < INT64_MAX)
		snprintf(range, sizeof range, "between %" PRId64 " and %" PRId64, o->least, o->most);
	else snprintf(range, sizeof range, "of at least %" PRId64, o->least);
	return quern_usage(command, "--%s must be a whole number %s, not '%s'", o->name, range, text);
}

static int take(const quern_command *command, const quern_option *o, const char *text) {
	if (o->flag) return *o->flag = true, QUERN_OPTIONS_READ;
	if (o->number) return take_number(command, o, text);
	if (!*text) return quern_usage(command, "--%s needs %s, not nothing", o->name, o->value);
	if (o->texts) {
		o->texts->at = quern_grow(o->texts->at, o->texts->n + 1, &o->texts->capacity, sizeof(char *));
		o->texts->at[o->texts->n++] = text;
	} else *o->text = text;
	return QUERN_OPTIONS_READ;
}

/* ---- faults ---- */

static int unknown(const quern_command *command, const quern_option *options, const char *given) {
	if (strncmp(given, "--", 2) != 0) return quern_usage(command, "unknown option '-%c'", optopt);
	const char *known[MOST_OPTIONS + 2] = { NULL };
	const size_t n = count(options);
	for (size_t k = 0; k < n; k++) known[k] = options[k].name;
	known[n] = "help";
	char *name = quern_copy(given + 2);
	name[strcspn(name, "=")] = 0;
	const char *near = quern_nearest(name, known);
	const int status = near ? quern_usage(command, "unknown option '--%s'; did you mean '--%s'?", name, near)
							: quern_usage(command, "unknown option '--%s'", name);
	free(name);
	return status;
}

static int fault(const quern_command *command, const quern_option *options, int code, const char *given) {
	const quern_option *o = optopt ? option_of(options, optopt) : NULL;
	if (code == ':' && o) return quern_usage(command, "--%s needs %s", o->name, o->value);
	if (o || optopt == 'h') return quern_usage(command, "--%s takes no value", o ? o->name : "help");
	return unknown(command, options, given);
}

static int take_words(const quern_command *command, quern_words *words, int argc, char **argv) {
	for (int i = optind; i < argc; i++) {
		if (words->n == words->most)
			return words->most ? quern_usage(command, "'%s' is one word too many", argv[i])
							   : quern_usage(command, "takes no word, found '%s'", argv[i]);
		words->at[words->n++] = argv[i];
	}
	return words->n < words->least ? quern_usage(command, "%s", words->missing) : QUERN_OPTIONS_READ;
}

int quern_options_read(
	const quern_command *command, const quern_option *options, quern_words *words, int argc, char **argv) {
	struct option table[MOST_OPTIONS + 2];
	char letters[2 * MOST_OPTIONS + 3];
	int status = QUERN_OPTIONS_READ, code;
	describe(options, table, letters);
	opterr = 0;
	optind = 0; /* from the beginning, whatever was read before */
	while (status == QUERN_OPTIONS_READ && (code = getopt_long(argc, argv, letters, table, NULL)) != -1) {
		const quern_option *o = option_of(options, code);
		if (code == 'h') return help(command, options);
		status = o ? take(command, o, optarg) : fault(command, options, code, argv[optind - 1]);
	}
	return status == QUERN_OPTIONS_READ ? take_words(command, words, argc, argv) : status;
}
