/* SPDX-License-Identifier: MIT */
/* watch - which plugin is being called, so that a crash in it, or its end of the program, is a sentence and status 3
 *
 * Calls are marked from the main thread alone; of a crash in a worker the address tells the plugin. What a signal
 * handler needs lives outside of a run, as nothing else does but what base/child.c notes of its process: see
 * docs/decisions/0013. */
#pragma once
#include "loader.h"

/* From here on, until the program ends: handlers of crashes (not under sanitizers, which have their own) and of exit. */
void quern_watch_begin(void);
/* Whose plugins are called; NULL: nobody's any more. */
void quern_watch_know(const quern_loader *);

/* Around a call; neither allocates. The texts must outlive it. */
void quern_watch_enter(const char *plugin, const char *function);
/* A copy of the process that a plugin has made ends here. */
void quern_watch_leave(void);

/* From here on see(arg, plugin, function) is called before every call, and see(arg, NULL, NULL) after it. */
void quern_watch_follow(void (*see)(void *arg, const char *plugin, const char *function), void *arg);

/* What stays if the program ends now, to be said then: "out/x keeps 3 frames". */
void quern_watch_keep(const char *fmt, ...) __attribute__((format(printf, 1, 2)));
