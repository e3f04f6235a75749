// SPDX-License-Identifier: Apache-2.0
#include "stencil/analyse/verify_kernel.h"

#include <fmt/format.h>

#include <set>

#include "stencil/build.h"

namespace dpde::stencil {

namespace {

/// Checks of a single kernel.
class KernelCheck {
 public:
  KernelCheck(const Kernel& kernel, std::vector<Violation>& violations)
      : kernel_(kernel), signature_(signature(kernel)), violations_(violations) {}

  void run() {
    if (kernel_.name.find('.') != std::string::npos) violation("has a name with a dot, which is not read back");
    if (kernel_.rank < 1 || kernel_.rank > max_rank) violation("has {} axes", kernel_.rank);
    check_locals();
    check_names();
    check_stores();
    check_scatters();
  }

 private:
  template <class... Args>
  void violation(fmt::format_string<Args...> text, Args&&... args) {
    const std::string what = fmt::format(text, std::forward<Args>(args)...);
    violations_.push_back({fmt::format("kernel {} {}", kernel_.name, what), kernel_.name});
  }

  void check_offset(const Offset& offset, const std::string& what) {
    for (int axis = kernel_.rank; axis < max_rank; ++axis) {
      if (offset[axis] != 0) violation("has an offset of {} along an axis it does not have", what);
    }
  }

  void check_interp(const Interp& i) {
    check_offset(i.offset, i.field);
    if (static_cast<int>(i.displacement.size()) != kernel_.rank) {
      violation("interpolates {} with {} displacements", i.field, i.displacement.size());
    }
    for (int axis = kernel_.rank; axis < max_rank; ++axis) {
      if (i.along[axis] != InterpolationBasis::linear)
        violation("takes a slope of {} along an axis it does not have", i.field);
    }
  }

  void check_node(const Expr& e) {
    if (const Local* l = as<Local>(e)) {
      if (!defined_.contains(l->name)) violation("uses local {} before it is defined", l->name);
    } else if (const Access* a = as<Access>(e)) {
      check_offset(a->offset, a->field);
    } else if (const Interp* i = as<Interp>(e)) {
      check_interp(*i);
    } else if (const Inside* inside = as<Inside>(e)) {
      check_offset(inside->offset, "inside");
      if (inside->grow < 0) violation("has inside grown by {}", inside->grow);
    } else if (const Call* c = as<Call>(e)) {
      if (static_cast<int>(c->arguments.size()) != arity(c->fn)) {
        violation("calls {} with {} arguments", name_of(c->fn), c->arguments.size());
      }
    }
  }

  void check_locals() {
    const auto check = [this](const Expr& e) { visit(e, [this](const Expr& part) { check_node(part); }); };
    for (const Let& let : kernel_.lets) {
      check(let.value);
      if (!defined_.insert(let.name).second) violation("defines local {} twice", let.name);
    }
    for (const Store& store : kernel_.stores) check(store.value);
    for (const Sum& sum : kernel_.sums) check(sum.value);
    for (const Scatter& scatter : kernel_.scatters) {
      check_interp(scatter.target);
      for (const Expr& d : scatter.target.displacement) check(d);
      check(scatter.value);
    }
  }

  void check_names() {
    std::map<std::string, std::string> kinds;
    const auto claim = [&](const std::string& name, const std::string& kind) {
      const auto [found, is_new] = kinds.emplace(name, kind);
      if (!is_new && found->second != kind) violation("uses {} both as {} and as {}", name, found->second, kind);
    };
    for (const Signature::Read& read : signature_.reads) claim(read.field, "field");
    for (const std::string& field : signature_.writes) claim(field, "field");
    for (const std::string& field : signature_.updates) claim(field, "field");
    for (const std::string& name : signature_.params) claim(name, "param");
    for (const std::string& name : signature_.sums) claim(name, "sum");
    for (const Let& let : kernel_.lets) claim(let.name, "local");
  }

  void check_stores() {
    std::set<std::string> stored, summed;
    for (const Store& store : kernel_.stores) {
      if (!stored.insert(store.field).second) violation("stores {} twice", store.field);
      const Signature::Read* read = signature_.find_read(store.field);
      if (!read) continue;
      if (!store.accumulate) violation("both reads and writes {}", store.field);
      if (store.accumulate && read->halo != std::array<int, max_rank>{}) {
        violation("adds to {} and reads it at an offset", store.field);
      }
    }
    for (const Sum& sum : kernel_.sums) {
      if (!summed.insert(sum.name).second) violation("has two sums {}", sum.name);
    }
  }

  void check_scatters() {
    if (kernel_.scatters.empty()) return;
    Kernel scatters_only = kernel_;
    scatters_only.stores.clear();
    scatters_only.sums.clear();
    std::set<std::string> used;
    for (const Scatter& scatter : kernel_.scatters) collect_locals(scatter.value, used);
    for (const Scatter& scatter : kernel_.scatters) {
      for (const Expr& d : scatter.target.displacement) collect_locals(d, used);
    }
    for (auto let = kernel_.lets.rbegin(); let != kernel_.lets.rend(); ++let) {
      if (used.contains(let->name)) collect_locals(let->value, used);
    }
    std::erase_if(scatters_only.lets, [&](const Let& let) { return !used.contains(let.name); });
    const Signature read_by_scatters = signature(scatters_only);
    for (const Store& store : kernel_.stores) {
      if (read_by_scatters.find_read(store.field)) violation("stores {}, which a scatter reads", store.field);
    }
    for (const std::string& field : read_by_scatters.updates) {
      if (signature_.find_read(field)) violation("both reads {} and scatters to it", field);
    }
  }

  static void collect_locals(const Expr& e, std::set<std::string>& used) {
    visit(e, [&](const Expr& part) {
      if (const Local* l = as<Local>(part)) used.insert(l->name);
    });
  }

  const Kernel& kernel_;
  const Signature signature_;
  std::vector<Violation>& violations_;
  std::set<std::string> defined_;
};

}  // namespace

void check_kernel(const Kernel& kernel, std::vector<Violation>& violations) { KernelCheck(kernel, violations).run(); }

}  // namespace dpde::stencil
