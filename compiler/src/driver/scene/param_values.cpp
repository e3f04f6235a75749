// SPDX-License-Identifier: Apache-2.0
#include "driver/scene/param_values.h"

namespace dpde::driver {

loop::ParamValues values_of(const Compiled& compiled) {
  loop::ParamValues values;
  if (!compiled.problem) return values;
  double cells = 1;
  for (const model::Parameter& parameter : compiled.problem->params) values[parameter.name] = parameter.value;
  for (const model::Axis& axis : compiled.problem->axes) {
    values["h" + axis.name] = axis.spacing();
    cells *= axis.cells;
  }
  values["dt"] = compiled.problem->step;
  values["cells"] = cells;
  return values;
}

}  // namespace dpde::driver
