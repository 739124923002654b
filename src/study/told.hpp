#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <flyball/control/margins.hpp>
#include <flyball/core/argument.hpp>
#include <flyball/core/errors.hpp>

/// How a job tells what the library refuses: in the words of the project file.
namespace flyball::study {

/// A step of a job, whose error is about the key that decides it.
/// @param hint  What to do about it with the keys there are; the step's own if empty.
template <class T>
[[nodiscard]] Expected<T> told_of(std::string_view key, Expected<T> step,
                                  std::string_view hint = {}) {
  return std::move(step).map_error([&](Error error) {
    error = std::move(error).about(std::string(key));
    return hint.empty() ? error : Error(std::move(error).hint(std::string(hint)));
  });
}

/// The refusal of a job, which no function of the library signs. @param noticed  Before it.
[[nodiscard]] inline tl::unexpected<Errors> refused(std::string_view job, Error error,
                                                    std::vector<Diagnostic> noticed) {
  return tl::unexpected(Errors(std::move(error).in(std::string(job))).after(std::move(noticed)));
}

/// A delay adds a state a period to the loop. @errors ArgumentError.
[[nodiscard]] inline Expected<void> check_delay(double delay, double period, std::string_view job) {
  return check_within(delay, 0.0, most_delay_periods * period, job, "controller.delay", "s");
}

}  // namespace flyball::study
