/* SPDX-License-Identifier: MIT */
/* quern_check_table - rows of parameters and uses, wherever a table holds them */
#pragma once
#include "check.h"

bool quern_check_is_unit(const check *, const char *unit);
void quern_check_parameter_rows(const check *, check_tally *, const quern_param *);
void quern_check_use_rows(const check *, check_tally *, const quern_use *);
