/* SPDX-License-Identifier: MIT */
/* frame - one plain HDF5 file per output */
#pragma once
#include "run.h"

/* Writes DIR/frames/NNNNNN.h5 and renews the files beside it; QUERN_E_IO with run->message on a fault. */
quern_status quern_frame_write(quern_run *, int64_t frame);
