#include <cstdio>
#include <iostream>
#include <memory>
#include <string>

#include <fmt/format.h>

#include <flyball/study/solve.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

std::string list_of_kinds() {
  std::string text = "Kinds, what a problem has [and may have], and what is answered:\n";
  for (const study::SolveKind& kind : study::solve_kinds()) {
    text +=
        fmt::format("  {:<20}{}{}  ->  {}\n", kind.name, kind.fields,
                    kind.optional.empty() ? "" : fmt::format(" [{}]", kind.optional), kind.answer);
  }
  return text;
}

/// Answers problem after problem; the status is the worst that any of them asks for.
class Stream {
 public:
  explicit Stream(const study::Solver& solver) : solver_(solver) {}

  void answer(const std::string& problem) {
    if (problem.find_first_not_of(" \t\r") == std::string::npos) {
      return;
    }
    study::SolveAnswer answer = solver_.solve(problem);
    answer.json += '\n';
    std::fwrite(answer.json.data(), 1, answer.json.size(), stdout);
    ++count_;
    if (!answer.solved) {
      status_ = std::max<int>(status_, answer.kind == ErrorKind::no_answer ? no_answer : bad_input);
    }
  }

  [[nodiscard]] int status() const { return status_; }
  [[nodiscard]] bool empty() const { return count_ == 0; }

 private:
  const study::Solver& solver_;
  int status_ = success;
  long count_ = 0;
};

int run(const std::string& kind) {
  const auto solver = study::Solver::create(kind);
  if (!solver) {
    tell(solver.error());
    print(study::Solver::error_json(solver.error()));
    return bad_input;
  }
  std::ios::sync_with_stdio(false);
  Stream stream(*solver);
  std::string line;
  bool first = true;
  while (std::getline(std::cin, line)) {
    if (first && line.find_first_not_of(" \t\r") != std::string::npos) {
      first = false;
      if (!study::Solver::is_complete(line)) {
        // One object over several lines, or lines of which the first is broken.
        std::string rest{std::istreambuf_iterator<char>(std::cin), {}};
        const std::string whole = line + '\n' + rest;
        if (study::Solver::is_complete(whole)) {
          stream.answer(whole);
          break;
        }
        stream.answer(line);
        for (std::size_t from = 0; from < rest.size();) {
          const std::size_t end = std::min(rest.find('\n', from), rest.size());
          stream.answer(rest.substr(from, end - from));
          from = end + 1;
        }
        break;
      }
    }
    stream.answer(line);
  }
  if (stream.empty()) {
    tell(Error(ArgumentError::empty)
             .in("solve")
             .about("standard input")
             .got("empty")
             .expected("one JSON object, or one on each line"));
    return bad_input;
  }
  return stream.status();
}

}  // namespace

void add_solve_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "solve", "Solve a control equation: JSON in, JSON out, one problem a line");
  command->footer(list_of_kinds() +
                  "\nMatrices are lists of rows, complex numbers [re, im], infinities \"inf\" and "
                  "\"-inf\"; a field id is echoed.\n"
                  "domain is \"continuous\" or \"discrete\"; method is zoh, foh, tustin, "
                  "forward-euler, backward-euler or matched.\n"
                  "\n  echo '{\"A\": [[1]], \"B\": [[1]], \"Q\": [[1]], \"R\": [[1]]}' | flyball "
                  "solve dare");
  auto kind = std::make_shared<std::string>();
  command->add_option("KIND", *kind, "Which equation")->required();
  command->callback([kind, &invocation] { invocation.status = run(*kind); });
}

}  // namespace flyball::app
