// SPDX-License-Identifier: Apache-2.0
// A function that is called before the call it is passed to returns: without the copy and the allocation of
// std::function, for walks that pass one at each node.
#pragma once

#include <type_traits>
#include <utility>

namespace dpde {

template <class>
class FunctionRef;

template <class Result, class... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  template <class F>
  requires std::is_class_v<F> && std::is_invocable_v<const F&, Arguments...> FunctionRef(const F& f)  // NOLINT: as f
      : f_(&f), call_([](const void* f, Arguments... arguments) {
          return static_cast<Result>((*static_cast<const F*>(f))(std::forward<Arguments>(arguments)...));
        }) {}
  FunctionRef(Result (*f)(Arguments...))  // NOLINT: as f
      : f_(reinterpret_cast<const void*>(f)), call_([](const void* f, Arguments... arguments) {
          return reinterpret_cast<Result (*)(Arguments...)>(const_cast<void*>(f))(
              std::forward<Arguments>(arguments)...);
        }) {}
  Result operator()(Arguments... arguments) const { return call_(f_, std::forward<Arguments>(arguments)...); }

 private:
  const void* f_;
  Result (*call_)(const void*, Arguments...);
};

}  // namespace dpde
