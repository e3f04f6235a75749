// SPDX-License-Identifier: Apache-2.0
// Names of the emitted C++: those of the source, changed only where C++ or the file itself needs the word.
#pragma once

#include <set>
#include <string>
#include <vector>

#include "loop/loop.h"
#include "support/names/name_supply.h"

namespace dpde::codegen {

/// A valid C++ identifier that looks like `name`.
std::string cpp_identifier(const std::string& name);

/// Field and offset of a stream: u, u_m1, u_p1_0.
std::string cpp_stream_name(const loop::Stream& stream, int rank);
std::string cpp_offset_suffix(const loop::Offset& offset, int rank);

/// The identifiers of one emitted function, all different but for `streams`: reads of a field that differ only along
/// the row share one pointer (fewer registers).
struct CppNames {
  std::vector<std::string> streams, grids, lets, sums;
  std::vector<std::string> uniforms;  // of the module; "" for those the row does not use
};
CppNames cpp_names(const loop::Module& module, const loop::Row& row);

/// Names of parameters, counters and uniforms where uniforms are computed; a uniform that is a parameter or a counter
/// shares its name.
struct CppUniformNames {
  std::vector<std::string> params, counters, uniforms;
};
CppUniformNames cpp_uniform_names(const loop::Module& module);

}  // namespace dpde::codegen
