// SPDX-License-Identifier: Apache-2.0
#include "stencil/text/as_written.h"

#include <algorithm>
#include <map>

#include "stencil/walk.h"

namespace dpde::stencil {

namespace {

constexpr std::string_view letters = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_.";

}  // namespace

std::string as_written(const Module& module, const Program& program, const std::string& text) {
  std::map<std::string, std::string> names;
  for_each_kind<Run>(program.body, [&](const Run& run) {
    const Kernel* kernel = module.find_kernel(run.kernel);
    if (kernel == nullptr || kernel->origin.kernel.empty()) return;
    names.emplace(kernel->name, kernel->origin.kernel);
    names.insert(kernel->origin.fields.begin(), kernel->origin.fields.end());
  });
  std::string result;
  for (std::size_t begin = 0; begin < text.size();) {
    const std::size_t word = std::min(text.find_first_of(letters, begin), text.size());
    const std::size_t end = std::min(text.find_first_not_of(letters, word), text.size());
    const auto found = names.find(text.substr(word, end - word));
    result += text.substr(begin, word - begin) + (found == names.end() ? text.substr(word, end - word) : found->second);
    begin = end;
  }
  return result;
}

SourceRange place_of(const Module& module, const std::string& kernel) {
  const Kernel* found = module.find_kernel(kernel);
  if (found == nullptr) return {};
  for (const Store& store : found->stores) {
    if (store.origin.range.is_known()) return store.origin.range;
  }
  return found->origin.range;
}

}  // namespace dpde::stencil
