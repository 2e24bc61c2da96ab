/* SPDX-License-Identifier: MIT */
/* render_watch - a picture for every newest frame of a run at work */
#pragma once

/* Calls draw(arg) whenever the folder has another last frame, until the run that holds it has ended and its last frame is
 * drawn, draw fails, or a signal asks for an end. Returns an exit status. */
int quern_render_watch(const char *folder, int (*draw)(void *), void *arg);
