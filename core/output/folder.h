/* SPDX-License-Identifier: MIT */
/* folder - folders on the disk */
#pragma once
#include <stdbool.h>

/* Makes a folder and those above it; true if it is there afterwards. On a fault errno says why. */
bool quern_folder_make(const char *path);
