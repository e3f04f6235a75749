// SPDX-License-Identifier: Apache-2.0
#include "syntax/expand/kernel_copies.h"

#include <fmt/format.h>

#include <algorithm>

#include "syntax/expand/rename.h"

namespace dpde::ast {

std::string Numbered::next(const std::string& name) {
  const std::size_t dot = std::min(name.find('.'), name.size());
  int& number = numbers_.try_emplace(name, 1).first->second;
  std::string result;
  do {
    result = fmt::format("{}_{}{}", name.substr(0, dot), ++number, name.substr(dot));
  } while (!used_.insert(result).second);
  return result;
}

KernelCopies::KernelCopies(const File& file) {
  for (const Declaration& declaration : file.declarations) {
    if (const Kernel* kernel = std::get_if<Kernel>(&declaration.kind)) names_.reserve(kernel->name.name);
    if (const Program* program = std::get_if<Program>(&declaration.kind)) names_.reserve(program->name.name);
  }
}

std::string KernelCopies::name_of(const Kernel& kernel, const Fields& fields) {
  const auto [known, is_new] = known_.try_emplace({kernel.name.name, fields});
  if (!is_new) return known->second;
  Kernel copy = rename(kernel, [&](const std::string& name) {
    const auto found = fields.find(name);
    return found == fields.end() ? name : found->second;
  });
  copy.name.name = known->second = names_.next(kernel.name.name);
  copy.copy_of = kernel.name.name;
  for (const auto& [own, field] : fields) copy.copied[field] = own;
  made_[kernel.name.name].push_back(std::move(copy));
  return known->second;
}

std::string KernelCopies::copy(const std::string& owner, const std::string& from, const std::string& to,
                               SourceRange range) {
  const std::string name = names_.fresh("copy_" + from.substr(0, from.find('.')));
  const auto name_at = [&](const std::string& text) { return Identifier{text, range}; };
  Kernel kernel{name_at(name), {{name_at(from), KernelRole::in, {}}, {name_at(to), KernelRole::out, {}}}, {}, {}};
  kernel.items.push_back({AssignItem{name_at(to), false, Expr(Node{Name{from}, range})}, range, {}});
  made_[owner].push_back(std::move(kernel));
  return name;
}

std::vector<Kernel> KernelCopies::of(const std::string& owner) const {
  const auto found = made_.find(owner);
  return found == made_.end() ? std::vector<Kernel>() : found->second;
}

}  // namespace dpde::ast
