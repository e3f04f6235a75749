// SPDX-License-Identifier: Apache-2.0
// A pass on the loop level. After it no two rows of the module are alike but for the names of fields and sums and for
// numbers and uniforms: what is repeated (the parts of a subcycle, the passes of a repeat, stages) is compiled once.
//
//  - The row that comes first stands for all that are like it; the sweeps of the others bind it to their own fields.
//  - What is not the same number or uniform for all of them becomes a uniform of the row's own: each sweep has a
//    block of consecutive uniforms for these.
//  - A row that is like no other stays as it is.
#pragma once

#include "loop/loop.h"

namespace dpde::loop {

Module share_rows(Module module);

}  // namespace dpde::loop
