// SPDX-License-Identifier: Apache-2.0
// The compiler in a host program: a .dpde file or text becomes a Simulation (dpde/runtime/simulation.h), in machine
// code.
//
//   dpde::Simulation sim = dpde::compile_file("heat.dpde", {.name = "rod", .set = {{"cells", "256"}}});
//   sim.run();
//
// Whatever is wrong with the text is one Error whose messages() are the compiler's diagnostics and whose what() shows
// them with the source lines. So is that of a solve in a run that finds no solution. Link dpde::dpde.
#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "dpde/runtime/error.h"
#include "dpde/runtime/simulation.h"

namespace dpde {

enum class HostBackend { jit, cpp, interpreter };

struct HostOptions {
  std::string name;                          // scene or task; may be left out where the file has just one
  std::map<std::string, std::string> set{};  // as --set: parameters, cells, cells.x, step, end, keys of the scheme
  std::string scheme{};                      // a scheme block of the file in place of the scene's
  HostBackend backend = HostBackend::jit;    // cpp: the system's C++ compiler
  int threads = 1;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();  // see SimulationOptions
  int slots = 0;
  const std::atomic<bool>* stop = nullptr;
  bool force = false;             // a step that ruins the run is an error; forced it is run all the same
  std::optional<bool> certify{};  // a task's derivatives on a few cells; unset: where that is cheap
  bool second_order =
      false;  // of a task: hessian_vector(); newton_cg has it anyway. Compiling takes up to twice as long
  /// Of a scene: initial states, parameters, coefficients, controls, networks by which its end is differentiated. They
  /// are the unknowns; gradient() is the transposed derivative of the states at the end, times a seed for each state u,
  /// which set_field("u_seed", values) gives (u_seed_ where the model has that name).
  std::vector<std::string> inputs{};
  std::vector<Message>* warnings = nullptr;  // where what the compiler warns of is put
};

/// Files the text loads (initial states, coefficients, data) are read, scenes that make data are run. A task begins
/// with the `from` of its unknowns.
/// @throws Error(input) for what is wrong with the text, Error(machine) and Error(run) as the kinds say.
Simulation compile_file(const std::string& path, const HostOptions& options = {});
/// `path` names the text in messages; the files it loads are looked for beside it.
Simulation compile_text(const std::string& text, const HostOptions& options = {},
                        const std::string& path = "text.dpde");

}  // namespace dpde
