// SPDX-License-Identifier: Apache-2.0
// A pass on the loop level. Rows that differ only in names of fields and sums, in numbers and in uniforms become one
// row: repeated code (substeps of a subcycle, passes of a repeat, stages) is compiled once.
//
//  - The first row replaces all rows like it; the sweeps of the others bind it to their own fields.
//  - A number or uniform that differs between these rows becomes one of the row's own uniforms: each sweep has a
//    block of consecutive uniforms for these.
//  - Other rows are not changed.
#pragma once

#include "loop/loop.h"

namespace dpde::loop {

Module share_rows(Module module);

}  // namespace dpde::loop
