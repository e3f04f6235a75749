// SPDX-License-Identifier: Apache-2.0
// dpde: the command as a process.
#include <malloc.h>

#include <string>
#include <vector>

#include "interrupt.h"
#include "run_command.h"
#include "standard_output.h"

int main(int argc, char** argv) {
  using namespace dpde::tools;
  mallopt(M_MMAP_THRESHOLD, 1 << 17);  // so that freed arrays are returned to the system, also after larger ones
  const Streams streams{standard_output(), stderr};
  return status_or_signal(run_command(std::vector<std::string>(argv + 1, argv + argc), streams));
}
