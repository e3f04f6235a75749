// SPDX-License-Identifier: Apache-2.0
// Handles of dpde_c.h, and conversion of exceptions to C errors.
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
  bool was_stopped = false;  // by a watch, during the present call
  bool has_gradient = false;
  std::optional<dpde::Recorder> recorder;
};

namespace dpde::host {

/// Error for the exception being handled; nullptr if there is no memory for it.
dpde_error* error_of_exception() noexcept;

/// A stop requested by the caller.
struct Stopped {};

/// Rejects input of the C interface. @throws Error(input)
[[noreturn]] void refuse(const std::string& why);

/// @throws Error(input) for NULL.
template <class... Pointers>
void need(const Pointers*... pointers) {
  if (((pointers == nullptr) || ...)) refuse("NULL where a simulation, a vector or a place for the result is needed");
}

/// JSON text as in dpde_error_json().
std::string json_of(const std::vector<Message>& messages);

/// Runs `call`; returns DPDE_OK, or the code of its exception.
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
