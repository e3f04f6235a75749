// SPDX-License-Identifier: Apache-2.0
// Identifiers of the emitted C++: the names of the model, changed only where they clash with C++ or the emitted file.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "loop/loop.h"
#include "support/names/name_supply.h"

namespace dpde::codegen {

/// A valid C++ identifier that looks like `name`.
std::string cpp_identifier(const std::string& name);

/// Name made of the field and offset of a stream: u, u_m1, u_p1_0.
std::string cpp_stream_name(const loop::Stream& stream, int rank);
std::string cpp_offset_suffix(const loop::Offset& offset, int rank);

/// Identifiers of one emitted function. All are distinct except `streams`: reads of a field that differ only along the
/// row share one pointer, which saves registers.
struct CppNames {
  std::vector<std::string> streams, grids, lets, sums;
  std::vector<std::string> uniforms;  // all of the module; "" for those that the row does not use
};
CppNames cpp_names(const loop::Module& module, const loop::Row& row);

/// Names of parameters, counters and uniforms in the function that computes uniforms. A uniform that is just a
/// parameter or a counter has the same name.
struct CppUniformNames {
  std::vector<std::string> params, counters, uniforms;
};
CppUniformNames cpp_uniform_names(const loop::Module& module);

}  // namespace dpde::codegen
