/* quern run - reads, settles, steps, writes; ends with a checkpoint whatever stops it in between */
#include "checkpoint.h"
#include "command.h"
#include "frame.h"
#include "h5.h"
#include "sidecar.h"
#include "summary.h"
#include "text.h"
#include <errno.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

typedef struct {
	const char *scene, *out, *until;
	const char **sets;
	size_t n_sets, capacity;
	uint32_t threads;
	bool resume, quiet;
} options;

typedef struct {
	quern_run *run;
	quern_series series;
	double start, saved; /* on the clock */
	int64_t progress_step;
} session;

static volatile sig_atomic_t interrupted;
static void on_signal(int number) {
	(void)number;
	interrupted = 1;
}

/* ---- the command line ---- */

static bool take_value(int argc, char **argv, int *i, const char *name, const char **value) {
	const size_t n = strlen(name);
	if (strncmp(argv[*i], name, n) != 0) return false;
	if (argv[*i][n] == '=') return *value = argv[*i] + n + 1, true;
	if (argv[*i][n]) return false;
	*value = *i + 1 < argc ? argv[++*i] : NULL;
	return true;
}

static int parse(options *o, int argc, char **argv) {
	for (int i = 1; i < argc; i++) {
		const char *value = NULL;
		if (take_value(argc, argv, &i, "--set", &value)) {
			if (!value) return quern_usage("run", "--set needs path.to.key=value");
			o->sets = quern_grow(o->sets, o->n_sets + 1, &o->capacity, sizeof(char *));
			o->sets[o->n_sets++] = value;
		} else if (take_value(argc, argv, &i, "--threads", &value)) {
			char *end;
			const long n = value ? strtol(value, &end, 10) : 0;
			if (!value || *end || n < 1 || n > 256)
				return quern_usage("run", "--threads needs a number from 1 to 256");
			o->threads = (uint32_t)n;
		} else if (take_value(argc, argv, &i, "--until", &value)) {
			if (!value) return quern_usage("run", "--until needs a time");
			o->until = value;
		} else if (!strcmp(argv[i], "-o")) {
			if (i + 1 == argc) return quern_usage("run", "-o needs a folder");
			o->out = argv[++i];
		} else if (!strcmp(argv[i], "--resume")) o->resume = true;
		else if (!strcmp(argv[i], "--quiet")) o->quiet = true;
		else if (argv[i][0] == '-') return quern_usage("run", "unknown option '%s'", argv[i]);
		else if (o->scene) return quern_usage("run", "one scene at a time: '%s' is a second one", argv[i]);
		else o->scene = argv[i];
	}
	return o->scene ? QUERN_EXIT_DONE : quern_usage("run", "a scene is missing");
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

static bool make_folders(const char *path) {
	char *copy = quern_copy(path);
	bool good = true;
	for (char *p = copy + 1; good; p++)
		if (*p == '/' || !*p) {
			const char kept = *p;
			*p = 0;
			good = !mkdir(copy, 0777) || errno == EEXIST;
			*p = kept;
			if (!kept) break;
		}
	free(copy);
	return good;
}

static void remove_frames(const char *folder) {
	for (int64_t k = 0;; k++) {
		char *path = quern_format("%s/frames/%06lld.h5", folder, (long long)k);
		const bool gone = unlink(path) != 0;
		free(path);
		if (gone) break;
	}
}

static quern_status open_folder(quern_run *run, bool fresh) {
	char why[256];
	char *frames = quern_format("%s/frames", run->folder),
		 *scene = quern_format("%s/scene.yaml", run->folder);
	quern_status status = QUERN_OK;
	if (!make_folders(frames))
		status = quern_run_stop(run, QUERN_E_IO, "folder %s cannot be made: %s", frames, strerror(errno));
	else {
		char *resolved = quern_scene_resolved(run->scene);
		if (fresh) {
			char *checkpoint = quern_format("%s/checkpoint.h5", run->folder);
			unlink(checkpoint);
			free(checkpoint);
			remove_frames(run->folder);
		}
		if (!quern_save_bytes(scene, resolved, strlen(resolved), why))
			status = quern_run_stop(run, QUERN_E_IO, "%s", why);
		free(resolved);
	}
	free(frames);
	free(scene);
	return status;
}

/* ---- progress and checkpoints ---- */

static void progress(session *s, bool settling) {
	quern_run *run = s->run;
	if (!quern_log_due(run->log)) return;
	const double wall = quern_wall() - s->start, t = quern_run_time(run), end = run->scene->general.end;
	if (settling)
		quern_log_progress(
			run->log, false, "settling: %lld steps, %.0f s", (long long)run->clock.settle_step, wall);
	else {
		const double left = t > 0 ? (wall - run->settle_wall) * (end - t) / t : 0;
		quern_log_progress(run->log, false, "t = %.4g of %.4g s (%.0f %%), step %lld, %.0f s left", t, end,
			100 * t / end, (long long)run->clock.step, left);
	}
}

static quern_status checkpoint(session *s) {
	s->run->wall_before += quern_wall() - s->start;
	s->start = s->saved = quern_wall();
	return quern_checkpoint_write(s->run, s->series.rows);
}

static bool due(const session *s) {
	const double every = s->run->scene->general.checkpoint;
	return every > 0 && quern_wall() - s->saved > every;
}

/* ---- the run ---- */

static quern_status settle(session *s) {
	quern_run *run = s->run;
	const double begin = quern_wall();
	while (!run->clock.settled && !interrupted && run->status == QUERN_OK) {
		quern_run_settle(run);
		progress(s, true);
		if (due(s)) checkpoint(s);
	}
	run->settle_wall += quern_wall() - begin;
	if (run->clock.settled && run->clock.settle_step)
		quern_log_add(run->log, 1, "settled in %lld steps, %.1f s", (long long)run->clock.settle_step,
			run->settle_wall);
	return run->status;
}

static quern_status output(session *s) {
	quern_run *run = s->run;
	run->clock.frame++;
	run->clock.at = run->clock.steps_in = 0;
	if (quern_run_look(run) != QUERN_OK) return run->status;
	if (quern_series_add(&s->series, run) != QUERN_OK) return run->status;
	return quern_frame_write(run, run->clock.frame);
}

static quern_status step_on(session *s, int64_t last) {
	quern_run *run = s->run;
	quern_clock *c = &run->clock;
	if (c->frame < 0 && output(s) != QUERN_OK) return run->status;
	while (c->frame < last && !interrupted && run->status == QUERN_OK) {
		if (!c->steps_in && quern_run_interval(run) != QUERN_OK) break;
		if (c->step == 0 && c->at == 0)
			quern_log_add(run->log, 1, "step %.4g s, set by %s", c->dt, run->limit_reason);
		if (quern_run_step(run) != QUERN_OK) break;
		if (c->at == c->steps_in && output(s) != QUERN_OK) break;
		progress(s, false);
		if (due(s)) checkpoint(s);
	}
	return run->status;
}

static int exit_status(const quern_run *run) {
	if (run->status == QUERN_E_IO) return QUERN_EXIT_IO;
	if (run->status == QUERN_E_PARAM) return QUERN_EXIT_SCENE;
	return run->status == QUERN_OK ? QUERN_EXIT_DONE : QUERN_EXIT_FAILED;
}

static void report_end(session *s, const char *status) {
	quern_run *run = s->run;
	const double wall = run->wall_before + quern_wall() - s->start;
	quern_log_add(run->log, 1, "%s: t = %.6g s, %lld steps, %.1f s (settling %.1f s), %s", status,
		quern_run_time(run), (long long)run->clock.step, wall, run->settle_wall, run->folder);
	char why[256];
	if (!quern_summary_write(run, &s->series, status, wall, why)) quern_run_stop(run, QUERN_E_IO, "%s", why);
}

static int finish(session *s) {
	quern_run *run = s->run;
	const bool stopped = interrupted && run->status == QUERN_OK;
	const char *status = run->status != QUERN_OK ? "failed" : stopped ? "interrupted" : "done";
	if (run->status == QUERN_OK) checkpoint(s);
	report_end(s, run->status == QUERN_OK ? status : "failed");
	if (run->status != QUERN_OK) {
		quern_run_complain(run, stderr);
		if (run->log) quern_log_add(run->log, 0, "error: %s", run->message ? run->message : "the run failed");
		return exit_status(run);
	}
	return stopped ? QUERN_EXIT_INTERRUPTED : QUERN_EXIT_DONE;
}

static bool resume(session *s, int64_t *rows, int *status) {
	char why[256];
	char *path = quern_format("%s/checkpoint.h5", s->run->folder);
	bool there = !access(path, F_OK);
	if (there && quern_checkpoint_read(s->run, path, rows, why) != QUERN_OK) {
		fprintf(stderr, "quern: error: %s: %s; remove it to start anew\n", path, why);
		*status = QUERN_EXIT_SCENE;
	}
	free(path);
	return there;
}

static int64_t last_frame(const quern_run *run, double until) {
	const int64_t last = quern_run_frames(run);
	if (!(until >= 0)) return last;
	int64_t k = 0;
	while (k < last && quern_run_frame_time(run, k) < until * (1 - 1e-12)) k++;
	return k;
}

static int drive(session *s, const options *o, double until) {
	quern_run *run = s->run;
	int64_t rows = 0;
	int status = QUERN_EXIT_DONE;
	const bool again = o->resume && resume(s, &rows, &status);
	if (status != QUERN_EXIT_DONE) return status;
	if (open_folder(run, !again) == QUERN_OK) {
		char *path = quern_format("%s/log.txt", run->folder);
		run->log = quern_log_create(path, o->quiet, again);
		free(path);
		if (o->resume && !again) quern_log_add(run->log, 1, "no checkpoint yet: starting from the beginning");
		run->sidecars = quern_sidecars_create(run->folder, again ? run->clock.frame + 1 : 0);
		quern_series_init(&s->series, run, rows);
	}
	if (run->status != QUERN_OK) {
		quern_run_complain(run, stderr);
		return exit_status(run);
	}
	if (!again && quern_run_setup(run) == QUERN_OK) run->mass_initial = quern_run_account(run).mass;
	if (run->status == QUERN_OK && settle(s) == QUERN_OK && !interrupted) step_on(s, last_frame(run, until));
	return finish(s);
}

static bool parse_until(const options *o, quern_run *run, double *until) {
	char why[160];
	*until = -1;
	if (!o->until) return true;
	if (quern_quantity_read(run->scene->units, o->until, "s", until, why) && *until >= 0) return true;
	quern_usage("run", "--until: %s", *until < 0 ? "must not be negative" : why);
	return false;
}

int quern_command_run(int argc, char **argv) {
	options o = { 0 };
	int status = parse(&o, argc, argv);
	if (status != QUERN_EXIT_DONE) return free(o.sets), status;
	signal(SIGINT, on_signal);
	signal(SIGTERM, on_signal);
	quern_scene *scene = quern_scene_read(o.scene, o.sets, &quern_host_table);
	quern_run *run = quern_report_errors(scene->report) ? NULL : quern_run_create(scene, o.threads);
	quern_report_print(scene->report, stderr);
	session s = { .run = run, .start = quern_wall(), .saved = quern_wall() };
	double until;
	if (!run || quern_report_errors(scene->report)) {
		fprintf(stderr, "quern: %zu fault%s in %s\n", quern_report_errors(scene->report),
			quern_report_errors(scene->report) == 1 ? "" : "s", o.scene);
		status = QUERN_EXIT_SCENE;
	} else if (!parse_until(&o, run, &until)) status = QUERN_EXIT_USAGE;
	else {
		signal(SIGXFSZ, SIG_IGN); /* a file beyond the limit is a fault of writing, with its message */
		run->folder = folder_of(&o);
		status = drive(&s, &o, until);
	}
	quern_series_finish(&s.series);
	if (run) quern_sidecars_destroy(run->sidecars);
	if (run) quern_run_destroy(run);
	else quern_scene_destroy(scene);
	free(o.sets);
	return status;
}
