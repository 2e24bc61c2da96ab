/* quern - simulates granular material with grains where grains matter and a continuum everywhere else */
#include "command.h"
#include "config.h"
#include "h5.h"
#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static const struct {
	const char *name, *arguments, *help;
	int (*run)(int argc, char **argv);
} commands[] = {
	{ "run",
		"SCENE.yaml [-o DIR] [--set path.to.key=value]... [--threads N] [--resume] [--force] [--until T] "
		"[--quiet]",
		"runs a scene", quern_command_run },
	{ "plan", "SCENE.yaml [--set ...] [--json]", "everything short of running", quern_command_plan },
	{ "list", "[--json]", "installed plugins", quern_command_list },
	{ "describe", "PLUGIN [--json]", "a plugin's parameters, units, ranges, sources",
		quern_command_describe },
	{ "schema", "[-o FILE]", "JSON Schema of scenes, for editors", quern_command_schema },
	{ "new", "KIND NAME [-o DIR]", "a plugin of your own from a template", quern_command_new },
	{ "check", "PLUGIN.so [--set key=value]... [--seconds N]", "conformance tests of a plugin",
		quern_command_check },
	{ "render", "DIR [--frame N] [--field NAME] [-o FILE.png] [--width N]", "a picture of a frame",
		quern_command_render },
};

static int help(FILE *out) {
	fputs("quern " QUERN_VERSION "\n\n", out);
	for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
		fprintf(
			out, "  quern %s %s\n        %s\n", commands[i].name, commands[i].arguments, commands[i].help);
	fputs("\nExit status: 0 done, 1 usage, 2 a bad scene, plugin or file, 3 the run failed, 4 files could "
		  "not be written,\n"
		  "130 interrupted with a checkpoint saved.\n",
		out);
	return QUERN_EXIT_DONE;
}

int quern_usage(const char *command, const char *fmt, ...) {
	va_list list;
	va_start(list, fmt);
	fprintf(stderr, "quern %s: ", command);
	vfprintf(stderr, fmt, list);
	va_end(list);
	for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
		if (!strcmp(commands[i].name, command))
			fprintf(stderr, "\nusage: quern %s %s", command, commands[i].arguments);
	fputc('\n', stderr);
	return QUERN_EXIT_USAGE;
}

int main(int argc, char **argv) {
	quern_h5_quiet();
	if (argc < 2) {
		help(stderr);
		return QUERN_EXIT_USAGE;
	}
	if (!strcmp(argv[1], "--help") || !strcmp(argv[1], "-h") || !strcmp(argv[1], "help")) return help(stdout);
	if (!strcmp(argv[1], "--version")) return puts("quern " QUERN_VERSION), QUERN_EXIT_DONE;
	for (size_t i = 0; i < sizeof commands / sizeof *commands; i++)
		if (!strcmp(commands[i].name, argv[1])) return commands[i].run(argc - 1, argv + 1);
	fprintf(stderr, "quern: unknown command '%s'; see quern --help\n", argv[1]);
	return QUERN_EXIT_USAGE;
}
