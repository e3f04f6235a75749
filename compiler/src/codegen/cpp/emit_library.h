// SPDX-License-Identifier: Apache-2.0
// Ahead-of-time compilation of a scene: emitted C++ with its rows and the runtime's tables, a header with a class for
// the scene, and a CMake file. The library needs only C; the class needs the runtime (dpde::runtime).
#pragma once

#include <set>
#include <string>
#include <vector>

#include "dpde/scene_abi.h"
#include "loop/loop.h"
#include "source/source_file.h"

namespace dpde::codegen {

/// C++ source with the rows of `module`, the programs that `scene` points to, and the scene as the symbol <name>_scene.
/// No other symbol is visible from outside. `scene` may come from tables without code.
std::string emit_library_source(const loop::Module& module, const dpde_scene& scene, const std::string& name,
                                const SourceFile& source);
std::string emit_library_header(const dpde_scene& scene, const std::string& name, const SourceFile& source);
/// Defines the imported target <name>.
std::string emit_library_cmake(const std::string& name);

/// Why the scene cannot have a class of this name: the name is a C++ keyword, or members have the same name. "" if it
/// can.
std::string library_name_clash(const dpde_scene& scene, const std::string& name);

/// First words of every emitted file.
std::string generated_mark();

}  // namespace dpde::codegen
