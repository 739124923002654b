#include <flyball/core/error.hpp>

#include <cmath>
#include <new>
#include <utility>

#include <flyball/core/errors.hpp>
#include <flyball/core/text.hpp>

#include "core/error_rows.hpp"
#include "core/format.hpp"

namespace flyball {

Error::Error(const Error& other) noexcept : info_(other.info_) {
  try {
    where_ = other.where_;
    subject_ = other.subject_;
    expected_ = other.expected_;
    got_ = other.got_;
    hint_ = other.hint_;
    evidence_ = other.evidence_;
  } catch (const std::bad_alloc&) {
    *this = Error(MemoryError::not_enough_memory);
  }
}

Error& Error::operator=(Error&& other) noexcept {
  if (this != &other) {
    info_ = other.info_;
    where_ = std::move(other.where_);
    subject_ = std::move(other.subject_);
    expected_ = std::move(other.expected_);
    got_ = std::move(other.got_);
    hint_ = std::move(other.hint_);
    evidence_ = std::move(other.evidence_);
  }
  return *this;
}

Error&& Error::in(std::string where) && {
  where_ = std::move(where);
  return std::move(*this);
}

Error&& Error::about(std::string subject) && {
  subject_ = std::move(subject);
  return std::move(*this);
}

Error&& Error::expected(std::string what) && {
  expected_ = std::move(what);
  return std::move(*this);
}

Error&& Error::got(std::string what) && {
  got_ = std::move(what);
  return std::move(*this);
}

Error&& Error::hint(std::string how_to_mend) && {
  hint_ = std::move(how_to_mend);
  return std::move(*this);
}

Error&& Error::with(std::string name, double value) && {
  evidence_.push_back({std::move(name), {value}, {}});
  return std::move(*this);
}

Error&& Error::with(std::string name, std::vector<double> values) && {
  evidence_.push_back({std::move(name), std::move(values), {}});
  return std::move(*this);
}

Error&& Error::with(std::string name, std::initializer_list<double> values) && {
  return std::move(*this).with(std::move(name), std::vector<double>(values));
}

Error&& Error::with(std::string name, std::string text) && {
  evidence_.push_back({std::move(name), {}, shortened(text)});
  return std::move(*this);
}

std::string to_string(const Error& error) {
  std::string text;
  if (!error.where_.empty()) {
    text += error.where_ + ": ";
  }
  if (!error.subject_.empty() && !error.got_.empty()) {
    text += detail::format("{} is {}", error.subject_, error.got_);
  } else if (!error.subject_.empty()) {
    text += detail::format("{}: {}", error.subject_, error.info_.summary);
  } else if (!error.got_.empty()) {
    text += detail::format("{}: got {}", error.info_.summary, error.got_);
  } else {
    text += error.info_.summary;
  }
  if (!error.expected_.empty()) {
    text += detail::format("; it must be {}", error.expected_);
  }
  if (!error.hint_.empty()) {
    text += "; " + error.hint_;
  }
  if (!error.evidence_.empty()) {
    text += " (";
    for (std::size_t i = 0; i < error.evidence_.size(); ++i) {
      const Evidence& evidence = error.evidence_[i];
      text += i == 0 ? "" : ", ";
      if (evidence.values.size() == 1) {
        const double value = evidence.values.front();
        const bool whole = std::abs(value) < 1e15 && value == std::floor(value);
        text += whole ? detail::format("{} = {:.0f}", evidence.name, value)
                      : detail::format("{} = {:.6g}", evidence.name, value);
      } else if (!evidence.values.empty()) {
        text += detail::format("{} = [{}]", evidence.name,
                               detail::comma_separated("{:.6g}", evidence.values));
      } else {
        text += detail::format("{}: {}", evidence.name, evidence.text);
      }
    }
    text += ")";
  }
  return shortened(text);
}

Errors::Errors(const Errors& other) noexcept : Error(other) {
  try {
    all_ = other.all_;
    diagnostics_ = other.diagnostics_;
  } catch (const std::bad_alloc&) {
    *this = Errors(Error(MemoryError::not_enough_memory));
  }
}

std::vector<QuotedError> Errors::all() const {
  return all_.empty() ? std::vector<QuotedError>{{*this, {}}} : all_;
}

Error not_enough_memory(std::string_view what) {
  return Error(MemoryError::not_enough_memory)
      .about("there")
      .got(detail::format("not enough memory for {}", what))
      .hint("give less at once, or free some");
}

ErrorInfo error_info(MemoryError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"not_enough_memory", "the machine has not enough memory", ErrorKind::environment},
  };
  return detail::info_of(code, "memory", rows);
}

ErrorInfo error_info(ArgumentError code) {
  static constexpr detail::ErrorRow rows[] = {
      {"wrong_shape", "the shape does not fit", ErrorKind::misuse},
      {"not_finite", "NaN or infinity", ErrorKind::misuse},
      {"not_symmetric", "the matrix is not symmetric", ErrorKind::misuse},
      {"not_positive", "the value is not positive", ErrorKind::misuse},
      {"out_of_range", "the value is out of range", ErrorKind::misuse},
      {"empty", "nothing is given", ErrorKind::misuse},
      {"wrong_unit", "the unit does not fit", ErrorKind::misuse},
      {"unknown_name", "the name is not known", ErrorKind::misuse},
      {"ambiguous_name", "the name fits several", ErrorKind::misuse},
      {"malformed", "the text cannot be read", ErrorKind::misuse},
  };
  return detail::info_of(code, "argument", rows);
}

}  // namespace flyball
