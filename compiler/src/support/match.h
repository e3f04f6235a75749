// SPDX-License-Identifier: Apache-2.0
// match() over std::variant and Variant: one case for each kind; a missing case fails to compile.
#pragma once

#include <cstdlib>
#include <type_traits>
#include <utility>
#include <variant>

#include "support/variant.h"

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

/// One branch for each kind: std::visit's function tables take twice as long to compile.
template <class Result, class Kind, class... Rest, class V, class Cases>
constexpr Result call_case(V& v, const Cases& cases) {
  using std::get_if;
  if (auto* kind = get_if<Kind>(&v)) return cases(*kind);
  if constexpr (sizeof...(Rest) > 0) return call_case<Result, Rest...>(v, cases);
  std::abort();  // valueless after an exception
}

/// Calls the one case that accepts the active alternative of `v`.
template <template <class...> class V, class First, class... Rest, class... Fs>
constexpr auto match(V<First, Rest...>& v, const Fs&... cases)
    -> std::invoke_result_t<const Overloaded<Fs...>&, First&> {
  using Cases = Overloaded<Fs...>;
  (require_case<Rest, std::is_invocable_v<const Cases&, Rest&>>(), ...);
  if constexpr ((std::is_invocable_v<const Cases&, Rest&> && ...)) {
    return call_case<std::invoke_result_t<const Cases&, First&>, First, Rest...>(v, Cases{cases...});
  } else {
    std::abort();
  }
}

template <template <class...> class V, class First, class... Rest, class... Fs>
constexpr auto match(const V<First, Rest...>& v, const Fs&... cases)
    -> std::invoke_result_t<const Overloaded<Fs...>&, const First&> {
  using Cases = Overloaded<Fs...>;
  (require_case<Rest, std::is_invocable_v<const Cases&, const Rest&>>(), ...);
  if constexpr ((std::is_invocable_v<const Cases&, const Rest&> && ...)) {
    return call_case<std::invoke_result_t<const Cases&, const First&>, First, Rest...>(v, Cases{cases...});
  } else {
    std::abort();
  }
}

}  // namespace dpde
