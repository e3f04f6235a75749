// SPDX-License-Identifier: Apache-2.0
// What `dpde check` prints of its reports: in short or all of it, and once what tasks of a scene share.
#pragma once

#include <map>
#include <set>
#include <string>

#include "command.h"
#include "report/report.h"

namespace dpde::tools {

class CheckText {
 public:
  explicit CheckText(bool shows_all) : shows_all_(shows_all) {}

  /// A line and the indented lines after it belong together. They are left out if an earlier task of this scene had the
  /// same. Details are left out too, unless all is shown; a last line says what --all adds.
  void tell(Job& job, const std::string& scene, const report::Report& report);

 private:
  bool shows_all_;
  std::map<std::string, std::set<std::string>> told_;  // by scene
};

}  // namespace dpde::tools
