#pragma once

#include <memory>
#include <type_traits>
#include <utility>

namespace flyball {

template <class Signature>
class FunctionRef;

/// A reference to anything that can be called, for arguments of compiled functions: two pointers,
/// no allocation, nothing owned. It must not outlive what it refers to, so take it as a parameter
/// and do not keep it.
///
/// ```
/// double bisect(FunctionRef<double(double)> f, double low, double high);
/// bisect([&](double t) { return position(t) - goal; }, 0.0, 1.0);
/// ```
template <class Result, class... Arguments>
class FunctionRef<Result(Arguments...)> {
 public:
  /// Refers to `callable`, which must live as long as this is called.
  template <class Callable>
    requires(!std::is_same_v<std::remove_cvref_t<Callable>, FunctionRef> &&
             !std::is_function_v<std::remove_reference_t<Callable>> &&
             std::is_invocable_r_v<Result, Callable&, Arguments...>)
  // NOLINTBEGIN(google-explicit-constructor, bugprone-forwarding-reference-overload)
  // NOLINTBEGIN(performance-unnecessary-value-param): an Eigen::Ref that is written to is a value.
  FunctionRef(Callable&& callable) noexcept
      : target_{.object = const_cast<void*>(static_cast<const void*>(std::addressof(callable)))},
        call_([](Target target, Arguments... arguments) -> Result {
          return (*static_cast<std::remove_reference_t<Callable>*>(target.object))(
              std::forward<Arguments>(arguments)...);
        }) {}
  /// Refers to a function.
  template <class Function>
    requires(std::is_function_v<Function> && std::is_invocable_r_v<Result, Function&, Arguments...>)
  FunctionRef(Function& function) noexcept
      : target_{.function = reinterpret_cast<void (*)()>(&function)},
        call_([](Target target, Arguments... arguments) -> Result {
          return (*reinterpret_cast<Function*>(target.function))(
              std::forward<Arguments>(arguments)...);
        }) {}

  /// Calls what it refers to.
  Result operator()(Arguments... arguments) const {
    return call_(target_, std::forward<Arguments>(arguments)...);
  }
  // NOLINTEND(performance-unnecessary-value-param)
  // NOLINTEND(google-explicit-constructor, bugprone-forwarding-reference-overload)

 private:
  union Target {
    void* object;
    void (*function)();
  };
  Target target_;
  Result (*call_)(Target, Arguments...);
};

}  // namespace flyball
