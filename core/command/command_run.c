/* SPDX-License-Identifier: MIT */
/* quern run - reads, settles, steps, writes; ends with a checkpoint whatever stops it in between */
#include "checkpoint.h"
#include "command.h"
#include "config.h"
#include "estimate.h"
#include "frame.h"
#include "options.h"
#include "progress.h"
#include "run_folder.h"
#include "settled.h"
#include "sidecar.h"
#include "start.h"
#include "summary.h"
#include "text.h"
#include "watch.h"
#include <errno.h>
#include <math.h>
#include <signal.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

typedef struct {
	const char *scene, *out, *until;
	quern_texts sets;
	int64_t threads;
	bool resume, force, quiet, verbose, no_cache;
} options;

typedef struct {
	quern_run *run;
	quern_run_folder folder;
	quern_series series;
	double start, saved; /* on the clock; `saved`: when the last checkpoint was written */
	double used;         /* s of the processor, of this process, that the run has booked */
	double until;        /* s; negative: to the end */
	bool begun;          /* the folder is this run's: what happens is noted there */
	char *alike;         /* runs of this key settle to the same state; NULL: it is neither taken nor kept */
	quern_progress progress;
	int64_t saved_step; /* of the last checkpoint; -1: none */
} session;

/* ---- signals ---- */

static volatile sig_atomic_t interrupted;

/* The first one asks for an end after the step; who asks twice does not want to wait. */
static void on_signal(int number) {
	if (interrupted++) {
		signal(number, SIG_DFL);
		raise(number);
	}
}

/* What the run was started to ignore, under nohup or in the background, it goes on ignoring. */
static void catch_signals(void) {
	const int stops[] = { SIGINT, SIGTERM, SIGHUP };
	struct sigaction ours = { .sa_handler = on_signal }, was;
	for (size_t i = 0; i < sizeof stops / sizeof *stops; i++)
		if (!sigaction(stops[i], NULL, &was) && was.sa_handler != SIG_IGN) sigaction(stops[i], &ours, NULL);
	signal(SIGPIPE, SIG_IGN); /* nobody reads the messages any more: no reason to stop */
	signal(SIGXFSZ, SIG_IGN); /* a file beyond the limit is a fault of writing, with its message */
}

/* ---- the command line ---- */

static int parse(options *o, int argc, char **argv) {
	quern_words words = { .missing = "a scene is missing", .least = 1, .most = 1 };
	const quern_option known[] = { QUERN_TEXT(&o->out, 'o', "output", "DIR",
									   "the folder of the run; default: out/NAME"),
		QUERN_TEXTS(&o->sets, "set", "PATH=VALUE", "a key of the scene; may stand several times"),
		QUERN_NUMBER(&o->threads, "threads", 1, 256, "how many work; results do not depend on it"),
		QUERN_FLAG(&o->resume, "resume", "go on from the checkpoint"),
		QUERN_FLAG(&o->force, "force", "replace the run in the folder; with --resume, take other plugins"),
		QUERN_TEXT(&o->until, 0, "until", "TIME", "stop at the first step at or after this time"),
		QUERN_FLAG(&o->no_cache, "no-cache", "settle even if a state of the same beginning is kept"),
		QUERN_FLAG(&o->quiet, "quiet", "only warnings and errors"),
		QUERN_FLAG(&o->verbose, "verbose", "log.txt also says what happens again and again"),
		QUERN_END_OPTIONS };
	const int status = quern_options_read(&quern_command_run, known, &words, argc, argv);
	o->scene = words.at[0];
	return status;
}

/* ---- the folder ---- */

static char *folder_of(const options *o) {
	if (o->out) return quern_copy(o->out);
	const char *name = strrchr(o->scene, '/');
	char *base = quern_copy(name ? name + 1 : o->scene);
	char *dot = strrchr(base, '.');
	if (dot) *dot = 0;
	char *folder = quern_format("out/%s", base);
	free(base);
	return folder;
}

/* ---- progress and checkpoints ---- */

/* s on the clock, of all that has led here: the start moves on with each checkpoint. */
static double wall_of(const session *s) { return s->run->wall_before + quern_wall() - s->start; }

static void progress(session *s) {
	if (quern_progress_due(&s->progress)) quern_progress_tell(&s->progress, s->run, wall_of(s));
}

/* For the sentence about a plugin that ends the program between here and the next frame or checkpoint. */
static void tell_what_stays(const session *s) {
	const quern_run *run = s->run;
	char checkpoint[96] = "no checkpoint";
	if (s->saved_step >= 0)
		snprintf(checkpoint, sizeof checkpoint, "a checkpoint of step %lld, from which --resume goes on",
			(long long)s->saved_step);
	quern_watch_keep("%s keeps %lld frame%s and %s", run->folder, (long long)run->clock.frame + 1,
		run->clock.frame ? "s" : "", checkpoint);
}

static void book_time(session *s) {
	const double now = quern_wall(), used = quern_processor();
	s->run->wall_before += now - s->start;
	s->run->processor += used - s->used;
	s->start = now;
	s->used = used;
}

static quern_status checkpoint(session *s) {
	book_time(s);
	/* rows that a checkpoint counts must be there after a power cut too */
	if (quern_series_flush(&s->series, s->run) != QUERN_OK) return s->run->status;
	const quern_status status = quern_checkpoint_write(s->run, s->series.rows);
	if (status == QUERN_OK) s->saved_step = s->run->clock.step;
	/* from now: else what takes that long to write would be written after every step */
	s->saved = quern_wall();
	tell_what_stays(s);
	return status;
}

static bool due(const session *s) {
	const double every = s->run->scene->general.checkpoint;
	return every > 0 && quern_wall() - s->saved > every;
}

/* ---- the run ---- */

/* Up to here; what stands in a checkpoint is not lost with the process. */
static void book_settling(session *s, double *begin) {
	const double now = quern_wall();
	s->run->settle_wall += now - *begin;
	*begin = now;
	book_time(s);
	s->run->settle_processor = s->run->processor;
}

static quern_status settle(session *s) {
	quern_run *run = s->run;
	double begin = quern_wall();
	const bool open = !run->clock.settled;
	if (s->alike) quern_settled_take(run, s->alike);
	const int warnings = quern_log_warnings(run->log); /* what was cut off would be taken for settled */
	const bool settles = !run->clock.settled;
	while (!run->clock.settled && !interrupted && quern_run_next(run) == QUERN_SETTLING) {
		progress(s);
		if (!due(s)) continue;
		book_settling(s, &begin);
		checkpoint(s);
	}
	const bool rests = settles && run->clock.settled && run->status == QUERN_OK;
	if (s->alike && rests && quern_log_warnings(run->log) == warnings) quern_settled_keep(run, s->alike);
	if (open) book_settling(s, &begin);
	if (settles && run->clock.settled && run->clock.settle_step)
		quern_log_add(run->log, 1, "settled in %lld steps, %.1f s", (long long)run->clock.settle_step,
			run->settle_wall);
	return run->status;
}

static quern_status check_log(quern_run *run) {
	const int fault = quern_log_fault(run->log);
	if (!fault) return QUERN_OK;
	return quern_run_stop(run, QUERN_E_IO, "%s/log.txt cannot be written: %s", run->folder, strerror(fault));
}

static quern_status output(session *s) {
	quern_run *run = s->run;
	quern_run_frame(run);
	if (quern_run_look(run) != QUERN_OK || quern_series_add(&s->series, run) != QUERN_OK ||
		quern_run_check_account(run) != QUERN_OK || quern_frame_write(run, run->clock.frame) != QUERN_OK)
		return run->status;
	tell_what_stays(s);
	return check_log(run);
}

/* A time that is later only by round-off has come. */
static bool has_come(const quern_run *run, double time) {
	return time >= 0 && run->clock.frame >= 0 && quern_run_time(run) >= time - 1e-9 * run->clock.dt;
}

static bool is_to_stop(const session *s) {
	return !quern_run_awaits_frame(s->run) && (interrupted || has_come(s->run, s->until));
}

static quern_status step_on(session *s) {
	quern_run *run = s->run;
	while (!is_to_stop(s)) {
		const quern_event event = quern_run_next(run);
		if (event == QUERN_FRAME_IS_DUE) {
			if (output(s) != QUERN_OK) break;
			if (run->clock.frame == 0) checkpoint(s); /* what settling has cost is not lost again */
		} else if (event == QUERN_STEPPED) {
			progress(s);
			if (!quern_run_awaits_frame(run) && due(s)) checkpoint(s);
		} else break;
	}
	return run->status;
}

static int exit_status(const quern_run *run) {
	if (run->status == QUERN_E_IO) return QUERN_EXIT_IO;
	if (run->status == QUERN_E_PARAM) return QUERN_EXIT_SCENE;
	return run->status == QUERN_OK ? QUERN_EXIT_DONE : QUERN_EXIT_FAILED;
}

/* ---- the end ---- */

static void report_end(session *s, const char *status) {
	quern_run *run = s->run;
	const double wall = wall_of(s);
	quern_log_add(run->log, 1, "%s: t = %.6g s, %lld steps, %.1f s (settling %.1f s), %s", status,
		quern_run_time(run), (long long)run->clock.step, wall, run->settle_wall, run->folder);
	if (run->status == QUERN_OK && !quern_run_over(run))
		quern_log_add(
			run->log, 1, "to go on: quern run %s/scene.yaml -o %s --resume", run->folder, run->folder);
	char why[256];
	book_time(s);
	quern_progress_end(&s->progress, run, status, wall);
	if (!quern_summary_write(run, &s->series, status, wall, why)) quern_run_stop(run, QUERN_E_IO, "%s", why);
}

static int finish(session *s) {
	quern_run *run = s->run;
	const bool over = quern_run_over(run), stopped = interrupted && !over;
	if (s->begun) {
		if (run->status == QUERN_OK) checkpoint(s);
		report_end(s, run->status != QUERN_OK ? "failed"
					  : over                  ? "done"
					  : stopped               ? "interrupted"
											  : "stopped");
		check_log(run);
	}
	if (run->status != QUERN_OK) {
		quern_run_complain(run, stderr);
		if (s->begun) quern_log_add(run->log, 0, "error: %s", run->message ? run->message : "the run failed");
		return exit_status(run);
	}
	return stopped ? QUERN_EXIT_INTERRUPTED : QUERN_EXIT_DONE;
}

/* ---- the beginning ---- */

/* The folder is this run's from here on; `again`: it was before. */
static quern_status take_over(session *s, bool again) {
	quern_run *run = s->run;
	char why[256] = "";
	if (!quern_run_folder_begin(&s->folder, run, why)) return quern_run_stop(run, QUERN_E_IO, "%s", why);
	quern_start_let_go(run); /* all of it is in the folder now */
	char *path = quern_format("%s/log.txt", run->folder);
	quern_log_open(run->log, path, again);
	free(path);
	s->begun = true;
	run->sidecars = quern_sidecars_create(run->folder, again ? run->clock.frame + 1 : 0, why);
	if (!run->sidecars) return quern_run_stop(run, QUERN_E_IO, "%s", why);
	if (*why) quern_log_add(run->log, 2, "%s", why);
	if (!again && quern_series_init(&s->series, run, 0) != QUERN_OK) return run->status;
	return check_log(run);
}

/* The set-up may find the scene at fault, and then nothing was touched. */
static quern_status begin_anew(session *s, const options *o) {
	quern_run *run = s->run;
	quern_text why = { 0 };
	const bool good = o->resume ? quern_run_folder_is_begun(&s->folder, &why)
								: quern_run_folder_is_free(&s->folder, run->scene, o->force, &why);
	if (!good) quern_run_stop(run, QUERN_E_IO, "%s", quern_text_string(&why));
	quern_text_finish(&why);
	if (!good) return run->status;
	if (o->resume) quern_log_add(run->log, 1, "no checkpoint yet: starting from the beginning");
	quern_start_hold(run);
	quern_run_identity(run); /* of the files as they are now */
	if (quern_run_setup(run) != QUERN_OK) return run->status;
	/* what goes on from a checkpoint may have begun with other plugins, or another file to read */
	if (!o->no_cache) s->alike = quern_settled_key(run);
	quern_run_folder_clear(&s->folder, run->scene);
	return take_over(s, false);
}

static void note_changes(quern_run *run, const char *said) {
	quern_log_add(
		run->log, 1, "resumed at t = %.6g s, step %lld", quern_run_time(run), (long long)run->clock.step);
	while (said && *said) {
		const size_t n = strcspn(said, "\n");
		quern_log_add(run->log, 1, "changed: %.*s", (int)n, said);
		said += n + (said[n] != 0);
	}
}

static quern_status go_on(session *s, const options *o, const char *path) {
	quern_run *run = s->run;
	quern_text said = { 0 }, why = { 0 };
	int64_t rows = 0;
	if (quern_checkpoint_read(run, path, o->force, &rows, &said, &why) != QUERN_OK)
		quern_run_stop(run, QUERN_E_PARAM, "%s: %s (to start anew: --force without --resume)", path,
			quern_text_string(&why));
	else if (has_come(run, s->until))
		fprintf(stderr, "quern: the run has come to t = %.9g s already: nothing to do until %.9g s\n",
			quern_run_time(run), s->until);
	else if (quern_series_init(&s->series, run, rows) == QUERN_OK) {
		note_changes(run, said.data);
		s->saved_step = run->clock.step;
		quern_run_folder_trim(&s->folder, run->clock.frame + 1);
		take_over(s, true);
	}
	quern_text_finish(&said);
	quern_text_finish(&why);
	return run->status;
}

/* The command as it was given, so that a log says by itself how a run came about. */
static void log_command(quern_log *log, int argc, char **argv) {
	quern_text line = { 0 };
	for (int i = 0; i < argc; i++) {
		const bool plain = argv[i][strcspn(argv[i], " \t\n'\"{}[]()*?$&;<>|#~\\")] == 0 && *argv[i];
		quern_text_add(&line, plain ? " %s" : " '%s'", argv[i]);
	}
	quern_log_add(log, 0, "quern " QUERN_VERSION ": quern%s", quern_text_string(&line));
	quern_text_finish(&line);
}

/* What it will take, before the first step. */
static void say_estimate(quern_run *run) {
	const quern_estimate e = quern_estimate_of(run);
	const uint32_t cores = quern_pool_workers(run->pool);
	char settling[32], running[32], say[600];
	quern_estimate_time(e.settling / cores, settling);
	quern_estimate_time(e.running / cores, running);
	if (quern_estimate_is_long(&e, cores, say)) quern_log_add(run->log, 2, "%s", say);
	else if (e.settle_steps > 0)
		quern_log_add(run->log, 1, "estimated: settling %s, running %s", settling, running);
	else quern_log_add(run->log, 1, "estimated: running %s", running);
}

static int drive(session *s, const options *o) {
	quern_run *run = s->run;
	quern_text why = { 0 };
	if (!quern_run_folder_take(&s->folder, run->folder, &why))
		quern_run_stop(run, QUERN_E_IO, "%s", quern_text_string(&why));
	else {
		char *path = quern_format("%s/checkpoint.h5", run->folder);
		if (o->resume && !access(path, F_OK)) go_on(s, o, path);
		else begin_anew(s, o);
		free(path);
	}
	quern_text_finish(&why);
	if (s->begun) tell_what_stays(s);
	if (s->begun && run->status == QUERN_OK) say_estimate(run);
	if (s->begun && run->status == QUERN_OK && settle(s) == QUERN_OK && !interrupted) step_on(s);
	return finish(s);
}

static bool parse_until(const options *o, quern_run *run, double *until) {
	char why[160];
	*until = -1;
	if (!o->until) return true;
	const bool good = quern_quantity_read(run->scene->units, o->until, "s", until, why);
	if (good && !signbit(*until)) return true;
	quern_usage(&quern_command_run, "--until: %s", good ? "must not be negative" : why);
	return false;
}

static int run_scene(int argc, char **argv) {
	options o = { 0 };
	int status = parse(&o, argc, argv);
	if (status != QUERN_OPTIONS_READ) return free(o.sets.at), status;
	catch_signals();
	quern_watch_begin();
	quern_scene *scene = quern_scene_read(o.scene, o.sets.at, &quern_host_table);
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, (uint32_t)o.threads);
	const size_t faults = quern_report_print(scene->report, stderr);
	session s = {
		.run = run, .folder = { .lock = -1 }, .saved_step = -1, .start = quern_wall(), .saved = quern_wall()
	};
	if (!run || quern_report_errors(scene->report)) {
		fprintf(stderr, "quern: %zu fault%s in %s\n", faults, faults == 1 ? "" : "s", o.scene);
		status = QUERN_EXIT_SCENE;
	} else if (!parse_until(&o, run, &s.until)) status = QUERN_EXIT_USAGE;
	else {
		run->folder = folder_of(&o);
		run->log = quern_log_create(o.quiet, o.verbose);
		log_command(run->log, argc, argv);
		status = drive(&s, &o);
	}
	quern_series_finish(&s.series);
	free(s.alike);
	quern_run_folder_give_back(&s.folder);
	if (run) quern_sidecars_destroy(run->sidecars);
	if (run) quern_run_destroy(run);
	else quern_scene_destroy(scene);
	free(o.sets.at);
	return status;
}

const quern_command quern_command_run = { "run", "SCENE.yaml [OPTION]...", "runs a scene", run_scene };
