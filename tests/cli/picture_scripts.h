// SPDX-License-Identifier: Apache-2.0
// A fake gnuplot that stores the scripts of a command.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "command_support.h"

namespace dpde::testing {

class PictureScripts : public Command {
 protected:
  void SetUp() override {
    Command::SetUp();
    fs::create_directory(path("bin"));
    write("bin/gnuplot", "#!/bin/sh\n[ \"$1\" = --version ] && exit 0\ncat \"$1\" >> scripts.gp\ntouch \"${1%.gp}\"\n");
    write("bin/ffmpeg", "#!/bin/sh\nexit 1\n");  // none, if one is installed too
    shell("chmod +x bin/*");
  }
  /// All scripts of the command.
  std::string scripts_of(const std::string& arguments) const {
    fs::remove(path("scripts.gp"));
    const Outcome outcome = shell("PATH=$PWD/bin:$PATH $DPDE " + arguments);
    EXPECT_EQ(outcome.status, 0) << outcome.err;
    return content(path("scripts.gp"));
  }
  /// Lines of the script that begin so.
  static std::vector<std::string> lines_with(const std::string& script, const std::string& begin) {
    std::vector<std::string> found;
    std::istringstream lines(script);
    for (std::string line; std::getline(lines, line);) {
      if (line.starts_with(begin)) found.push_back(line);
    }
    return found;
  }
};

}  // namespace dpde::testing
