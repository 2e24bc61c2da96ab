/* SPDX-License-Identifier: MIT */
#include "render_watch.h"
#include "exit.h"
#include "render.h"
#include "text.h"
#include <errno.h>
#include <fcntl.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <time.h>
#include <unistd.h>

/* The run's own lock, which the kernel takes from it however it ends. */
static bool is_at_work(const char *folder) {
	char *path = quern_format("%s/.quern.lock", folder);
	const int fd = open(path, O_RDONLY | O_CLOEXEC);
	const bool held = fd >= 0 && flock(fd, LOCK_SH | LOCK_NB) && errno == EWOULDBLOCK;
	if (fd >= 0) close(fd);
	free(path);
	return held;
}

/* Signals that would end the program wait until they are asked for; those that it was started to ignore stay ignored. */
static sigset_t hold_signals(void) {
	const int stops[] = { SIGINT, SIGTERM, SIGHUP };
	struct sigaction was;
	sigset_t held;
	sigemptyset(&held);
	for (size_t i = 0; i < sizeof stops / sizeof *stops; i++)
		if (!sigaction(stops[i], NULL, &was) && was.sa_handler != SIG_IGN) sigaddset(&held, stops[i]);
	sigprocmask(SIG_BLOCK, &held, NULL);
	return held;
}

int quern_render_watch(const char *folder, int (*draw)(void *), void *arg) {
	const struct timespec pause = { .tv_nsec = 200000000 };
	const sigset_t stops = hold_signals();
	int64_t drawn = -1;
	for (;;) {
		/* first whether it goes on: what comes after the last look is drawn then */
		const bool goes_on = is_at_work(folder);
		const int64_t last = quern_render_frame_last(folder);
		/* a run that begins anew has none for a while; where there never was one, drawing says so */
		if (last < 0 ? drawn < 0 && !goes_on : last != drawn) {
			const int status = draw(arg);
			/* what it takes away under one's eyes is no fault */
			if (status != QUERN_EXIT_DONE && (!goes_on || quern_render_frame_last(folder) == last))
				return status;
			drawn = last;
		}
		if (!goes_on) return QUERN_EXIT_DONE;
		if (sigtimedwait(&stops, NULL, &pause) > 0) return QUERN_EXIT_INTERRUPTED;
	}
}
