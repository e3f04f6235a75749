// SPDX-License-Identifier: Apache-2.0
// match() over std::variant: one case per kind, and a kind without a case does not compile.
#pragma once

#include <cstdlib>
#include <type_traits>
#include <utility>
#include <variant>

namespace dpde {

template <class... Fs>
struct Overloaded : Fs... {
  using Fs::operator()...;
};
template <class... Fs>
Overloaded(Fs...) -> Overloaded<Fs...>;

template <class Kind, bool handled>
consteval void require_case() {
  static_assert(handled, "match(): no case for this Kind");
}

/// Calls the one case that accepts the active alternative of `v`.
template <class First, class... Rest, class... Fs>
constexpr auto match(std::variant<First, Rest...>& v, const Fs&... cases)
    -> std::invoke_result_t<const Overloaded<Fs...>&, First&> {
  using Cases = Overloaded<Fs...>;
  (require_case<Rest, std::is_invocable_v<const Cases&, Rest&>>(), ...);
  if constexpr ((std::is_invocable_v<const Cases&, Rest&> && ...)) {
    return std::visit(Cases{cases...}, v);
  } else {
    std::abort();
  }
}

template <class First, class... Rest, class... Fs>
constexpr auto match(const std::variant<First, Rest...>& v, const Fs&... cases)
    -> std::invoke_result_t<const Overloaded<Fs...>&, const First&> {
  using Cases = Overloaded<Fs...>;
  (require_case<Rest, std::is_invocable_v<const Cases&, const Rest&>>(), ...);
  if constexpr ((std::is_invocable_v<const Cases&, const Rest&> && ...)) {
    return std::visit(Cases{cases...}, v);
  } else {
    std::abort();
  }
}

}  // namespace dpde
