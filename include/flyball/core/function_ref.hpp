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
      : object_(const_cast<void*>(static_cast<const void*>(std::addressof(callable)))),
        call_([](void* object, Arguments... arguments) -> Result {
          return (*static_cast<std::remove_reference_t<Callable>*>(object))(
              std::forward<Arguments>(arguments)...);
        }) {}

  /// Calls what it refers to.
  Result operator()(Arguments... arguments) const {
    return call_(object_, std::forward<Arguments>(arguments)...);
  }
  // NOLINTEND(performance-unnecessary-value-param)
  // NOLINTEND(google-explicit-constructor, bugprone-forwarding-reference-overload)

 private:
  void* object_;
  Result (*call_)(void*, Arguments...);
};

}  // namespace flyball
