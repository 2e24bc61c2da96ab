/* SPDX-License-Identifier: MIT */
/* summary - summary.json: what a run was, what it cost, and what it kept */
#pragma once
#include "observe.h"

/* `status`: "done", "interrupted" or "failed". False if the file cannot be written. */
bool quern_summary_write(quern_run *, const quern_series *, const char *status, double wall, char why[256]);
