// SPDX-License-Identifier: Apache-2.0
// The compiler in a host program: a .dpde file or text becomes a Simulation (dpde/runtime/simulation.h), in machine
// code.
//
//   dpde::Simulation sim = dpde::compile_file("heat.dpde", {.name = "rod", .set = {{"cells", "256"}}});
//   sim.run();
//
// Mistakes in the text are thrown as one Error. Its messages() are the compiler's diagnostics, and what() shows them
// with the source lines. The same holds for a solve in a run that finds no solution. Link dpde::dpde.
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

/// How a scene is computed: machine code made in memory, by the system's C++ compiler, or by the interpreter.
enum class HostBackend { jit, cpp, interpreter };

/// Options of compile_file() and compile_text().
struct HostOptions {
  std::string name;                          // scene or task; may be empty if the file has just one
  std::map<std::string, std::string> set{};  // as --set: parameters, cells, cells.x, step, end, keys of the scheme
  std::string scheme{};                      // a scheme block of the file, replaces the scene's
  HostBackend backend = HostBackend::jit;    // cpp: the system's C++ compiler
  int threads = 1;
  std::int64_t checkpoint_bytes = std::numeric_limits<std::int64_t>::max();  // see SimulationOptions
  int slots = 0;                            // number of stored states; > 0 overrides checkpoint_bytes
  const std::atomic<bool>* stop = nullptr;  // checked before each step; once true, the run stops
  bool force = false;                       // an unstable step is an error; with force it is run nevertheless
  std::optional<bool> certify{};            // check a task's derivatives on a few cells; unset: if that is cheap
  bool second_order =
      false;  // of a task: hessian_vector(); newton_cg has it anyway. Compiling takes up to twice as long
  /// Of a scene: the initial states, parameters, coefficients, controls and networks by which its end is
  /// differentiated. They are the unknowns. gradient() is then the transposed derivative of the states at the end,
  /// times a seed for each state u. set_field("u_seed", values) sets the seed (u_seed_ if the model has that name).
  std::vector<std::string> inputs{};
  std::vector<Message>* warnings = nullptr;  // not null: the compiler's warnings are appended to it
};

/// Compiles a scene or a task of a .dpde file to machine code. Files that the text loads (initial states, coefficients,
/// data) are read, and scenes that make data are run. A task starts with the `from` values of its unknowns.
/// @throws Error(input) for mistakes in the text or the options, Error(machine) for memory, disk or operating system,
/// Error(run) if a scene that makes data cannot be run.
Simulation compile_file(const std::string& path, const HostOptions& options = {});
/// The same for a text. `path` names the text in messages; files that it loads are searched in the folder of `path`.
Simulation compile_text(const std::string& text, const HostOptions& options = {},
                        const std::string& path = "text.dpde");

}  // namespace dpde
