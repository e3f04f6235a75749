// SPDX-License-Identifier: Apache-2.0
// Loop level as readable text, for users and golden tests.
#pragma once

#include <string>

#include "loop/loop.h"

namespace dpde::loop {

std::string print(const Module& module);
/// One row, with its uniforms by name.
std::string print(const Module& module, const Row& row);
std::string print(const Module& module, const Row& row, const Expr& e);
/// The definition of a uniform.
std::string print(const Module& module, const UniformDef& uniform);

}  // namespace dpde::loop
