// SPDX-License-Identifier: Apache-2.0
// The handles of dpde_c.h, and how what is thrown becomes an error of C.
#pragma once

#include <exception>
#include <new>
#include <optional>
#include <string>
#include <vector>

#include "dpde/dpde_c.h"
#include "dpde/recorder.h"
#include "host/opened.h"

struct dpde_error {
  int32_t code = DPDE_ERROR_MACHINE;
  std::string text, json = "[]";
};

struct dpde_model {
  dpde::SourceFile source;
  std::vector<std::string> scenes, tasks;
};

struct dpde_sim {
  explicit dpde_sim(dpde::host::Opened opened);
  dpde::Simulation simulation;
  std::vector<std::string> params, states, outputs, fields, networks, unknowns, seeds;
  std::string warnings_text, warnings_json;
  std::string reason;        // of the last optimisation
  bool was_stopped = false;  // by a watch, in the present call
  bool has_gradient = false;
  std::optional<dpde::Recorder> recorder;
};

namespace dpde::host {

/// Of the exception that is being handled. nullptr when there is no memory for it.
dpde_error* error_of_exception() noexcept;

/// A stop that the caller asked for.
struct Stopped {};

/// Input that the C interface itself refuses.
[[noreturn]] void refuse(const std::string& why);

/// @throws Error(input) for NULL.
template <class... Pointers>
void need(const Pointers*... pointers) {
  if (((pointers == nullptr) || ...)) refuse("NULL where a simulation, a vector or a place for the result is needed");
}

/// As dpde_error_json().
std::string json_of(const std::vector<Message>& messages);

/// What `call` does; DPDE_OK, or the code of what it threw.
template <class Call>
int32_t guarded(dpde_error** error, const Call& call) noexcept {
  try {
    call();
    return DPDE_OK;
  } catch (...) {
    dpde_error* const found = error_of_exception();
    const int32_t code = found == nullptr ? DPDE_ERROR_MACHINE : found->code;
    error != nullptr ? void(*error = found) : dpde_error_free(found);
    return code;
  }
}

}  // namespace dpde::host
