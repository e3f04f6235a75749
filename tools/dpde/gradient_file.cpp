// SPDX-License-Identifier: Apache-2.0
#include "gradient_file.h"

#include <fmt/format.h>

#include "driver/report/run_description.h"
#include "netcdf_output.h"
#include "scene_output.h"

namespace dpde::tools {

void save_gradient(Job& job, const driver::Session& session, std::vector<GradientField> fields, const Json& result) {
  if (job.options().out.empty()) return;
  const std::string& task = session.problem().task->name;
  save_text(job, task + "_gradient.json", result.dump(2) + "\n");
  if (fields.empty()) return;
  NetcdfContent content;
  NetcdfNames names = free_names(session);
  content.attributes = attributes_of(job, session, "gradient", task);
  content.attributes.push_back({"dpde_task", task});
  content.attributes.push_back({"dpde_certificate", result.at("certificate").dump()});
  content.variables.push_back({names.free("loss"),
                               {},
                               described("loss of task " + task),
                               {result.at("loss").get<double>()},
                               false,
                               group_of_numbers});
  const AxisNames axes = add_axes(content, driver::run_axes(session.problem(), session.axes()), names);
  for (GradientField& field : fields) {
    const model::Placement placement = driver::placement_of(session.problem(), field.name);
    std::vector<std::string> dimensions;
    for (std::size_t a = axes.size(); a-- > 0;) dimensions.push_back(axes[a][placement[a] ? 1 : 0]);
    content.variables.push_back({names.free("gradient_" + field.name), dimensions,
                                 described("derivative of the loss by " + field.name), std::move(field.values)});
  }
  guarded(job, [&] { save_text(job, task + "_gradient.nc", compose_netcdf(std::move(content))); });
}

}  // namespace dpde::tools
