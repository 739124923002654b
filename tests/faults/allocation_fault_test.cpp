#include <new>
#include <string>

#include <gtest/gtest.h>

#include <flyball/core/function_ref.hpp>
#include <flyball/core/quantity.hpp>
#include <flyball/core/unit_algebra.hpp>
#include <flyball/io/csv.hpp>
#include <flyball/io/log.hpp>
#include <flyball/io/sysid_json.hpp>
#include <flyball/io/wpilog.hpp>
#include <flyball/math/expression/formula.hpp>
#include <flyball/solve/solver.hpp>
#include <flyball/study/analyze.hpp>
#include <flyball/study/project.hpp>

#include "faults/allocation_fault.hpp"
#include "io/examples.hpp"

/// Every allocation of every reader and of every kind of problem fails once, and then for good:
/// what comes of it is std::bad_alloc or a refusal, no memory is lost, and the next call answers as
/// if nothing had been.
namespace flyball::test {
namespace {

/// @param sparsely  Of thousands: each of the first hundred, then one in a hundredth of those
/// before.
void try_every_allocation(const std::string& what, FunctionRef<std::string()> work,
                          bool sparsely = false) {
  if (!injects_faults()) {
    GTEST_SKIP() << "the sanitizers' allocator is left alone";
  }
  (void)work();  // what is made once and kept
  const std::string answer = work();
  for (const auto memory :
       {AllocationFault::Memory::comes_back, AllocationFault::Memory::stays_short}) {
    std::size_t k = 0;
    for (bool struck = true; struck;) {
      k += 1 + (sparsely ? k / 100 : 0);
      const long before = blocks_held();
      {
        AllocationFault fault(k, memory);
        try {
          (void)work();
        } catch (const std::bad_alloc&) {
        }
        struck = fault.struck();
      }
      ASSERT_EQ(blocks_held(), before) << what << ": allocation " << k;
    }
    EXPECT_EQ(work(), answer) << what;
  }
}

template <class T>
std::string told(const Expected<T>& result) {
  return result ? "read" : to_string(result.error());
}

TEST(AllocationFaults, ReadersOfLogs) {
  const std::string wpilog = to_wpilog(example_log(4)).value();
  try_every_allocation("WPILOG", [&] { return told(parse_wpilog(wpilog, "a.wpilog")); });
  const std::string sysid = to_sysid_json(example_sysid(2)).value();
  try_every_allocation("SysId JSON", [&] { return told(parse_sysid_json(sysid, "a.json")); });
  const std::string csv = "Time (s),x [m],state\n0,1,on\n0.1,2,off\n0.2,,\"a, b\"\n";
  try_every_allocation("CSV", [&] { return told(parse_csv(csv, "a.csv")); });
  for (const std::string& bytes : {wpilog, sysid, csv, std::string("nothing")}) {
    try_every_allocation("log", [&] { return told(parse_log(bytes, "a")); });
  }
  try_every_allocation("cut", [&] { return told(parse_sysid_json(sysid.substr(0, 90), "a")); });
}

TEST(AllocationFaults, ReadersOfTexts) {
  for (const char* text : {"8 kg", "8 stone", "8"}) {
    try_every_allocation("quantity",
                         [&] { return told(parse_quantity(text, Dimension::mass, "the mass")); });
  }
  try_every_allocation("unit", [] { return told(parse_si_unit("kg m^2/(s^2 rad)")); });
  for (const char* text : {"-g/l*sin(x) + atan2(x, 1)^2", "g*(x", "x + l", "y + 1"}) {
    try_every_allocation("formula", [&] {
      expression::FormulaSet set;
      set.variables = {{"x", "rad"}};
      set.parameters = {{"g", "m/s^2", 9.8}, {"l", "m", 0.3}};
      set.outputs = {{"f", text, ""}};
      return std::to_string(expression::compile(set).has_value());
    });
  }
}

// Not of what is no TOML: toml++ words that in functions that it declares noexcept.
TEST(AllocationFaults, ReaderOfProjects) {
  const std::string text =
      "[mechanism]\ntype = \"elevator\"\nmass = \"8 kg\" # of all\nmotor = \"krakenX60\"\n"
      "gearing = 10\ndrum_radius = \"2 cm\"\n";
  for (const std::string& project :
       {text, text + "gearng = 1\nmotor_count = \"two\"\n", text + "[profile]\ngoal = \"1 V\"\n",
        std::string("[mechanism]\ntype = \"wing\"\n")}) {
    const auto read = [&] {
      const auto found = study::parse_project(project, "a.toml");
      return found ? std::string("read") : to_string(found.error());
    };
    ASSERT_EQ(read() == "read", project == text) << read();
    try_every_allocation("project", read);
  }
}

// tl::expected copies errors in functions that it declares noexcept.
TEST(AllocationFaults, ACopyOfAnErrorTakesNoMemoryThatIsNotThere) {
  const std::string long_text(100, 'x');
  const Errors errors(
      {{Error(ArgumentError::malformed).in(long_text).with("row", {1.0, 2.0}), long_text},
       {Error(ArgumentError::empty).about(long_text), long_text}});
  try_every_allocation("copies", [&] {
    const Expected<int> one = tl::unexpected(Error(errors));
    const Expected<int> copied = one;
    ExpectedAll<int> all = copied;  // an Error becomes Errors
    const std::string first = to_string(all.error());
    const ExpectedAll<int> both = tl::unexpected(errors);
    all = both;
    EXPECT_TRUE(all.error().is(ArgumentError::malformed) ||
                all.error().is(MemoryError::not_enough_memory));
    return first + to_string(all.error()) + std::to_string(all.error().all().size());
  });
}

TEST(AllocationFaults, ReaderOfModels) {
  for (const char* text : {R"--({"A": [[0, 1], [0, -2]], "B": [[0], [3]], "T": 0.02,
                              "states": ["x (m)", "v (m/s)"]})--",
                           R"({"A": [[0, 1], [0, -2]], "B": [[0]]})", "{\"A\": 1e999}"}) {
    try_every_allocation(text, [&] {
      const auto model = study::parse_model(text, "a.json");
      return model ? std::string("read") : to_string(model.error());
    });
  }
}

class EveryKind : public testing::TestWithParam<std::size_t> {};

TEST_P(EveryKind, Example) {
  const solve::Kind& kind = solve::kinds()[GetParam()];
  const solve::Solver solver = solve::Solver::create(kind.name).value();
  // Those of a design that is searched for, a hundred thousand and more, at steps of a hundredth.
  const bool is_search = kind.name == "certify" || kind.name == "mu" || kind.name == "hinfsyn" ||
                         kind.name == "mixsyn";
  try_every_allocation(
      std::string(kind.name), [&] { return solver.solve(kind.example).json; }, is_search);
}

/// An example with its numbers replaced by one.
std::string with_numbers(std::string_view example, std::string_view number) {
  std::string text;
  bool quoted = false;
  bool inside = false;
  for (const char c : example) {
    quoted = quoted != (c == '"');
    const std::string_view of_numbers = inside ? "0123456789+-.eE" : "0123456789-";
    const bool part = !quoted && of_numbers.find(c) != std::string_view::npos;
    text += !part ? std::string(1, c) : inside ? "" : std::string(number);
    inside = part;
  }
  return text;
}

TEST_P(EveryKind, Refusals) {
  const solve::Kind& kind = solve::kinds()[GetParam()];
  const solve::Solver solver = solve::Solver::create(kind.name).value();
  const auto refused = [&](const std::string& problem) {
    EXPECT_NE(solver.solve(problem).json.find("\"error\""), std::string::npos) << problem;
    try_every_allocation(problem, [&] { return solver.solve(problem).json; });
  };
  refused("{}");
  refused("{\"nothing of it\": 1}");
  refused(std::string(kind.example).substr(0, kind.example.size() / 2));
  refused(with_numbers(kind.example, "1e999"));
  // The mathematics of most kinds says no to one of these.
  for (const char* number : {"0", "-1"}) {
    const std::string problem = with_numbers(kind.example, number);
    try_every_allocation(problem, [&] { return solver.solve(problem).json; }, true);
  }
}

INSTANTIATE_TEST_SUITE_P(AllocationFaults, EveryKind,
                         testing::Range(std::size_t{0}, solve::kinds().size()),
                         [](const testing::TestParamInfo<std::size_t>& kind) {
                           std::string name(solve::kinds()[kind.param].name);
                           for (char& c : name) {
                             c = c == '-' ? '_' : c;
                           }
                           return name;
                         });

}  // namespace
}  // namespace flyball::test
