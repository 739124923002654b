#pragma once

#include <limits>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <flyball/core/expected.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/mechanisms/mechanism_kind.hpp>
#include <flyball/study/model_job.hpp>

/// The fields of jobs as data. A row says everything that is known of a field; the reader and the
/// writer of project files, the command's options, the schema and the docs page come from the rows.
///
/// A new field is a member and a row. A new section is a struct, its rows and an entry in the
/// document's list. A new job is a list of sections.
namespace flyball::study {

struct Project;

enum class FieldType {
  quantity,  ///< A number with the unit of its dimension.
  list,      ///< One quantity a state.
  text,
  whole,  ///< A whole number.
  flag,   ///< true or false.
  names,  ///< A list of texts.
  map,    ///< A table whose keys a person chooses, of texts.
};

/// What a number must be, each of a list.
enum class Range { any, not_zero, not_negative, positive };

/// What a key or a section is about; what is about another kind of file is refused. Motors are
/// those of a mechanism or of a drivetrain; loops those that take a delay, of a mechanism or a
/// model.
enum class Subject { any, mechanism, model, drive, motors, loops };

/// Whether what is about one thing has no meaning in a file of another.
[[nodiscard]] constexpr bool is_about_other(Subject of, Subject file) {
  return of == Subject::motors  ? file == Subject::model
         : of == Subject::loops ? file == Subject::drive
                                : of != Subject::any && of != file;
}

/// TOML's largest whole number.
constexpr long long largest_whole = std::numeric_limits<long long>::max();

/// A value, once read; nothing if it is not given.
using FieldValue = std::variant<std::monostate, bool, long long, double, std::string,
                                std::vector<double>, std::vector<std::string>, NamedTexts>;

/// The dimensions of what a mechanism moves. They decide which units a goal or a tolerance has.
struct SignalDimensions {
  std::span<const Dimension> states;
  Dimension output = Dimension::dimensionless;  ///< What is measured and followed.
  Dimension rate = Dimension::dimensionless;    ///< By which the output changes.
  Dimension acceleration = Dimension::dimensionless;
  Dimension effort = Dimension::dimensionless;  ///< What pushes it: a force or a torque.
};

/// A dimension that is fixed, or one of the mechanism's.
struct FieldDimension {
  enum Of { fixed, output, rate, acceleration, effort, states };

  // NOLINTNEXTLINE(google-explicit-constructor): rows say `voltage` or `FieldDimension::output`.
  constexpr FieldDimension(Dimension of_every_mechanism) : dimension(of_every_mechanism) {}
  // NOLINTNEXTLINE(google-explicit-constructor)
  constexpr FieldDimension(Of of_the_mechanism) : of(of_the_mechanism) {}

  Of of = fixed;
  Dimension dimension = Dimension::dimensionless;
};

/// How a value is fetched from a section's struct, and put there.
struct FieldAccess {
  FieldValue (*get)(const void* section);
  void (*set)(void* section, const FieldValue& value);
};

/// A key of a section: a row, made by `quantity`, `list`, `text`, `whole`, `flag`, `names` or
/// `map`.
struct Field {
  std::string_view key;
  FieldType type;
  FieldAccess access;
  std::string_view example;  ///< As written in a file.
  std::string_view help;     ///< What it is, for options and the docs page.
  FieldDimension dimension = Dimension::dimensionless;
  Range range = Range::any;
  long long least = 0;  ///< Of a whole number.
  long long most = largest_whole;
  std::string_view absent = {};   ///< What holds without it, where the default says too little.
  std::string_view choices = {};  ///< Of a text: the known words, separated by a comma and a space.
  Expected<void> (*check)(const std::string& text) = nullptr;  ///< Of a text.
  bool required = false;                                       ///< Wherever the section is written.
  std::string_view option = {};    ///< Of the command line, if not the key; "-" for none.
  std::string_view metavar = {};   ///< What the option takes, if not the dimension's name.
  Subject subject = Subject::any;  ///< If not its section's.

 private:
  // Before its callers, or clang has no body for it yet where a row is constexpr.
  template <class Member>
  constexpr Field with(Member Field::* member, std::type_identity_t<Member> value) const {
    Field changed = *this;
    changed.*member = value;
    return changed;
  }

 public:
  // What few rows say.
  constexpr Field without(std::string_view what_holds) const {
    return with(&Field::absent, what_holds);
  }
  constexpr Field one_of(std::string_view words) const { return with(&Field::choices, words); }
  constexpr Field checked(Expected<void> (*by)(const std::string&)) const {
    return with(&Field::check, by);
  }
  constexpr Field must() const { return with(&Field::required, true); }
  constexpr Field called(std::string_view name) const { return with(&Field::option, name); }
  constexpr Field no_option() const { return with(&Field::option, "-"); }
  constexpr Field takes(std::string_view what) const { return with(&Field::metavar, what); }
  constexpr Field of(Subject what) const { return with(&Field::subject, what); }
};

constexpr Field quantity(std::string_view key, FieldAccess access, FieldDimension dimension,
                         Range range, std::string_view example, std::string_view help) {
  return {.key = key,
          .type = FieldType::quantity,
          .access = access,
          .example = example,
          .help = help,
          .dimension = dimension,
          .range = range};
}

/// A list of one quantity a state. @param range  Of each.
constexpr Field list(std::string_view key, FieldAccess access, FieldDimension dimension,
                     Range range, std::string_view example, std::string_view help) {
  Field field = quantity(key, access, dimension, range, example, help);
  field.type = FieldType::list;
  return field;
}

constexpr Field text(std::string_view key, FieldAccess access, std::string_view example,
                     std::string_view help) {
  return {.key = key, .type = FieldType::text, .access = access, .example = example, .help = help};
}

constexpr Field whole(std::string_view key, FieldAccess access, long long least, long long most,
                      std::string_view example, std::string_view help) {
  return {.key = key,
          .type = FieldType::whole,
          .access = access,
          .example = example,
          .help = help,
          .least = least,
          .most = most};
}

constexpr Field flag(std::string_view key, FieldAccess access, std::string_view example,
                     std::string_view help) {
  return {.key = key, .type = FieldType::flag, .access = access, .example = example, .help = help};
}

constexpr Field names(std::string_view key, FieldAccess access, std::string_view example,
                      std::string_view help) {
  return {.key = key, .type = FieldType::names, .access = access, .example = example, .help = help};
}

/// What the texts mean is found out when all of them are there.
constexpr Field map(std::string_view key, FieldAccess access, std::string_view example,
                    std::string_view help) {
  return {.key = key, .type = FieldType::map, .access = access, .example = example, .help = help};
}

/// A table of a file: [name].
struct Section {
  std::string_view name;
  std::span<const Field> fields;
  /// The section's struct in the document; null if it is not there.
  /// @param create  Put it there.
  void* (*within)(void* document, bool create);
  std::string_view summary;          ///< For the docs page.
  std::string_view needed_for = {};  ///< Completes "…, which `it` needs": why keys are required.
  Subject subject = Subject::any;
};

/// Everything that a file may say, for the struct that holds it.
struct Document {
  std::span<const Section> sections;
  /// Nothing while the mechanism is not known.
  std::optional<SignalDimensions> (*signals)(const void* document);
};

/// The project file's (of `Project`).
[[nodiscard]] const Document& project_document();

/// A section of the project file, which must be one.
[[nodiscard]] const Section& section_of(std::string_view name);

/// What a key is called in files: "controller.period"; without a section the key itself.
[[nodiscard]] std::string name_of(std::string_view section, std::string_view key);

/// Its option: "--max-voltage", or empty.
[[nodiscard]] std::string option_of(const Field& field);

/// Checks the range of every number of a project that did not come from a file.
/// @param where  The function's name. @errors ArgumentError.
[[nodiscard]] Expected<void> check_ranges(const Project& project, std::string_view where);

/// The struct of a section in a document that is only read; null if it is not there.
[[nodiscard]] inline const void* find(const Section& section, const void* document) {
  return section.within(const_cast<void*>(document), false);
}

namespace detail {

template <class T>
FieldValue to_value(const T& member) {
  if constexpr (requires { member.has_value(); }) {
    return member ? to_value(*member) : FieldValue{};
  } else if constexpr (requires { member.si(); }) {
    return member.si();
  } else if constexpr (requires { member.empty(); }) {
    return member.empty() ? FieldValue{} : FieldValue{member};
  } else if constexpr (std::is_same_v<T, bool> || std::is_same_v<T, double>) {
    return member;
  } else if constexpr (std::is_integral_v<T>) {
    return static_cast<long long>(member);
  } else {
    return std::string(to_string(member));
  }
}

template <class T>
void from_value(T& member, const FieldValue& value) {
  if constexpr (requires { member.has_value(); }) {
    from_value(member.emplace(), value);
  } else if constexpr (requires { member.si(); }) {
    member = T(std::get<double>(value));
  } else if constexpr (std::is_same_v<T, bool> || !std::is_integral_v<T>) {
    if constexpr (std::is_enum_v<T>) {
      member = *mechanisms::parse_mechanism_kind(std::get<std::string>(value));
    } else {
      member = std::get<T>(value);
    }
  } else {
    member = static_cast<T>(std::get<long long>(value));
  }
}

template <class Object, class Member>
Object object_of(Member Object::*);

}  // namespace detail

/// A member of the section's struct: `at<&ControllerOptions::period>()`, or of a struct in it.
template <auto first, auto... rest>
constexpr FieldAccess at() {
  using Object = decltype(detail::object_of(first));
  return {[](const void* section) {
            return detail::to_value(((static_cast<const Object*>(section)->*first).*....*rest));
          },
          [](void* section, const FieldValue& value) {
            detail::from_value(((static_cast<Object*>(section)->*first).*....*rest), value);
          }};
}

/// A section's struct: `within<&Project::job, &DesignJob::controller>`; an optional one is there
/// once a file has the section.
template <auto first, auto... rest>
void* within(void* document, bool create) {
  using Object = decltype(detail::object_of(first));
  auto& section = ((static_cast<Object*>(document)->*first).*....*rest);
  if constexpr (requires { section.has_value(); }) {
    if (!section && create) {
      section.emplace();
    }
    return section ? &*section : nullptr;
  } else {
    return &section;
  }
}

}  // namespace flyball::study
