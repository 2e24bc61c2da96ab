/* quern - simulates granular material with grains where grains matter and a continuum everywhere else */
#include "command.h"
#include "config.h"
#include "h5.h"
#include "text.h"
#include <errno.h>
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const struct {
	const char *name, *arguments, *help;
	int (*run)(int argc, char **argv);
} commands[] = {
	{ "run", "SCENE.yaml [OPTION]...", "runs a scene", quern_command_run },
	{ "plan", "SCENE.yaml [OPTION]...", "everything short of running", quern_command_plan },
	{ "list", "[--json]", "installed plugins", quern_command_list },
	{ "describe", "NAME [--json]", "keys, units, ranges, sources of a plugin, a section (grains), or `scene`",
		quern_command_describe },
	{ "schema", "[-o FILE]", "JSON Schema of scenes, for editors", quern_command_schema },
	{ "new", "KIND NAME [-o DIR]", "a plugin of your own from a template", quern_command_new },
	{ "check", "PLUGIN.so [OPTION]...", "conformance tests of a plugin", quern_command_check },
	{ "render", "DIR [OPTION]...", "a picture of a frame", quern_command_render },
};

enum { N_COMMANDS = sizeof commands / sizeof *commands };

static int help(FILE *out) {
	fputs("quern " QUERN_VERSION "\n\n", out);
	for (size_t i = 0; i < N_COMMANDS; i++)
		fprintf(
			out, "  quern %s %s\n        %s\n", commands[i].name, commands[i].arguments, commands[i].help);
	fputs("\nquern COMMAND --help says what a command takes.\n"
		  "Exit status: 0 done, 1 usage, 2 a bad scene, plugin or file, 3 the run failed, 4 files could "
		  "not be written,\n"
		  "130 interrupted with a checkpoint saved.\n",
		out);
	return QUERN_EXIT_DONE;
}

void quern_print_usage(const char *command, FILE *out) {
	for (size_t i = 0; i < N_COMMANDS; i++)
		if (!strcmp(commands[i].name, command))
			fprintf(out, "usage: quern %s %s", command, commands[i].arguments);
}

int quern_usage(const char *command, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	fprintf(stderr, "quern %s: ", command);
	vfprintf(stderr, fmt, list);
	va_end(list);
	fputc('\n', stderr);
	quern_print_usage(command, stderr);
	fprintf(stderr, "; see quern %s --help\n", command);
	return QUERN_EXIT_USAGE;
}

static int unknown(const char *name) {
	const char *known[N_COMMANDS + 1] = { NULL };
	for (size_t i = 0; i < N_COMMANDS; i++) known[i] = commands[i].name;
	const char *near = quern_nearest(name, known);
	fprintf(stderr, "quern: unknown command '%s'%s%s%s; see quern --help\n", name,
		near ? "; did you mean '" : "", near ? near : "", near ? "'?" : "");
	return QUERN_EXIT_USAGE;
}

static int run(int argc, char **argv) {
	if (argc < 2) {
		help(stderr);
		return QUERN_EXIT_USAGE;
	}
	if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) return help(stdout);
	if (!strcmp(argv[1], "--version")) return puts("quern " QUERN_VERSION), QUERN_EXIT_DONE;
	for (size_t i = 0; i < N_COMMANDS; i++)
		if (!strcmp(commands[i].name, argv[1])) return commands[i].run(argc - 1, argv + 1);
	return unknown(argv[1]);
}

/* What was printed but could not be written, to a full disk, is not done. */
int main(int argc, char **argv) {
	quern_h5_quiet();
	const int status = run(argc, argv);
	if (!fflush(stdout) && !ferror(stdout)) return status;
	fprintf(stderr, "quern: error: the output cannot be written: %s\n", strerror(errno));
	return status == QUERN_EXIT_DONE ? QUERN_EXIT_IO : status;
}
