// SPDX-License-Identifier: Apache-2.0
// A scene ahead of time: the emitted C++ with the tables the runtime needs beside its rows, a header with a class for
// the scene, and what CMake has to know. The library needs nothing but C; the class needs the runtime (dpde::runtime).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "dpde/scene_abi.h"
#include "loop/loop.h"
#include "source/source_file.h"

namespace dpde::codegen {

/// The rows of `module`, the programs that `scene` points to, and the scene as the symbol <name>_scene; nothing else is
/// visible from outside. `scene` may come from tables without code.
std::string emit_library_source(const loop::Module& module, const dpde_scene& scene, const std::string& name,
                                const SourceFile& source);
std::string emit_library_header(const dpde_scene& scene, const std::string& name, const SourceFile& source);
/// Defines the imported target <name>.
std::string emit_library_cmake(const std::string& name);

/// Why there can be no class of this name for the scene: a word of C++, members of the same name; "" when there can.
std::string library_name_clash(const dpde_scene& scene, const std::string& name);

/// The first words of every file emitted here.
std::string generated_mark();

}  // namespace dpde::codegen
