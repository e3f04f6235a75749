// SPDX-License-Identifier: Apache-2.0
// match() over std::variant and Variant: one case for each kind; a missing case fails to compile. Several kinds may
// share a case. match_some() is for what only a few kinds have.
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

/// `Cases`: so that each match() without a case is an error of its own, not only the first one of a source.
template <class Kind, class Cases>
consteval void require_case() {
  static_assert(std::is_invocable_v<const Cases&, Kind&>, "match(): no case for this Kind");
}

/// One branch for each kind: std::visit's function tables take twice as long to compile.
template <class Result, class Kind, class... Rest, class V, class Cases>
constexpr Result call_case(V& v, const Cases& cases) {
  using std::get_if;
  if (auto* kind = get_if<Kind>(&v)) return cases(*kind);
  if constexpr (sizeof...(Rest) > 0) return call_case<Result, Rest...>(v, cases);
  std::abort();  // valueless after an exception
}

/// Calls the one case that accepts the active alternative of `v`. What it returns is deduced, so that no case is looked
/// at with a kind that is const where `v` is not.
template <template <class...> class V, class First, class... Rest, class... Fs>
constexpr decltype(auto) match(V<First, Rest...>& v, const Fs&... cases) {
  using Cases = Overloaded<Fs...>;
  if constexpr (std::is_invocable_v<const Cases&, First&> && (std::is_invocable_v<const Cases&, Rest&> && ...)) {
    return call_case<std::invoke_result_t<const Cases&, First&>, First, Rest...>(v, Cases{cases...});
  } else {
    require_case<First, Cases>();
    (require_case<Rest, Cases>(), ...);
    std::abort();
  }
}

template <template <class...> class V, class First, class... Rest, class... Fs>
constexpr decltype(auto) match(const V<First, Rest...>& v, const Fs&... cases) {
  using Cases = Overloaded<Fs...>;
  if constexpr (std::is_invocable_v<const Cases&, const First&> &&
                (std::is_invocable_v<const Cases&, const Rest&> && ...)) {
    return call_case<std::invoke_result_t<const Cases&, const First&>, First, Rest...>(v, Cases{cases...});
  } else {
    require_case<const First, Cases>();
    (require_case<const Rest, Cases>(), ...);
    std::abort();
  }
}

/// In a case that several kinds share, the others still having to be named: `[](const OneOf<Fill, Fold> auto&) {...}`.
template <class T, class... Kinds>
concept OneOf = (std::is_same_v<std::remove_const_t<T>, Kinds> || ...);

template <class... Kinds>
struct Ignored {
  constexpr void operator()(const OneOf<Kinds...> auto&) const {}
};
/// A case of match(): nothing is to be done about these kinds.
template <class... Kinds>
inline constexpr Ignored<Kinds...> ignored;

template <auto answer, class... Kinds>
struct Answer {
  constexpr auto operator()(const OneOf<Kinds...> auto&) const { return answer; }
};
/// A case of match(): what it returns for these kinds.
template <auto answer, class... Kinds>
inline constexpr Answer<answer, Kinds...> always;

/// Whether `v` is one of these kinds, for whom none but these will do: a kind which is added is refused there.
template <class... Kinds, template <class...> class V, class... All>
constexpr bool is_one_of(const V<All...>& v) {
  using std::get_if;
  return ((get_if<Kinds>(&v) != nullptr) || ...);
}

template <class Case, class... Kinds>
consteval void require_kind() {
  static_assert((std::is_invocable_v<const Case&, Kinds&> || ...), "match_some(): a case for no kind");
}

/// Calls the case of the active alternative of `v`, if it has one: for what only the kinds with a case have, so that a
/// kind which is added needs no decision here. Where it would need one, match() does not compile before it is made.
template <template <class...> class V, class... Kinds, class... Fs>
constexpr void match_some(V<Kinds...>& v, const Fs&... cases) {
  (require_kind<Fs, Kinds...>(), ...);
  const Overloaded<Fs...> all{cases...};
  const auto call_if_any = [&](auto& kind) {
    if constexpr (std::is_invocable_v<decltype(all)&, decltype(kind)>) all(kind);
  };
  match(v, call_if_any);
}
template <template <class...> class V, class... Kinds, class... Fs>
constexpr void match_some(const V<Kinds...>& v, const Fs&... cases) {
  (require_kind<Fs, const Kinds...>(), ...);
  const Overloaded<Fs...> all{cases...};
  const auto call_if_any = [&](const auto& kind) {
    if constexpr (std::is_invocable_v<decltype(all)&, decltype(kind)>) all(kind);
  };
  match(v, call_if_any);
}

}  // namespace dpde
