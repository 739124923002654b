#include <cstdio>
#include <iostream>
#include <memory>
#include <new>
#include <string>

#include <flyball/solve/documentation.hpp>
#include <flyball/solve/solver.hpp>

#include "commands.hpp"
#include "console.hpp"

namespace flyball::app {

namespace {

bool is_blank(const std::string& line) {
  return line.find_first_not_of(" \t\r\n") == std::string::npos;
}

/// Answers problem after problem; the status is the worst that any of them asks for.
class Stream {
 public:
  explicit Stream(const solve::Solver& solver) : solver_(solver) {}

  void answer(const std::string& problem) {
    if (is_blank(problem)) {
      return;
    }
    solve::Answer answer = solver_.solve(problem);
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
  const solve::Solver& solver_;
  int status_ = success;
  long count_ = 0;
};

/// Calls back with each line of a text.
template <class F>
void for_each_line(const std::string& text, const F& f) {
  for (std::size_t from = 0; from < text.size();) {
    const std::size_t end = std::min(text.find('\n', from), text.size());
    f(text.substr(from, end - from));
    from = end + 1;
  }
}

/// Whether a text whose first line is not whole is one object over several lines, even a broken
/// one: the other lines continue as such an object does, and none is a problem of its own.
bool is_one_object(const std::string& text) {
  if (solve::Solver::is_complete(text)) {
    return true;
  }
  bool one = text.starts_with('{');
  bool first = true;
  for_each_line(text, [&](const std::string& line) {
    one =
        one && (first || is_blank(line) ||
                (std::string_view(" \t}]\"[,-0123456789").find(line[0]) != std::string_view::npos));
    first = false;
  });
  return one;
}

int refuse(const Error& error) {
  tell(error);
  print(solve::Solver::error_json(error));
  return bad_input;
}

/// Answers what stands on standard input.
int answer_all(const std::string& kind) {
  const auto solver = solve::Solver::create(kind);
  if (!solver) {
    return refuse(solver.error());
  }
  std::ios::sync_with_stdio(false);
  Stream stream(*solver);
  std::string line;
  while (std::getline(std::cin, line) && is_blank(line)) {
  }
  if (!is_blank(line) && !solve::Solver::is_complete(line)) {
    line += '\n';
    line.append(std::istreambuf_iterator<char>(std::cin), {});
    if (is_one_object(line)) {
      stream.answer(line);
    } else {
      for_each_line(line, [&](const std::string& each) { stream.answer(each); });
    }
  } else {
    do {
      stream.answer(line);
    } while (std::getline(std::cin, line));
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

struct Options {
  std::string kind;
  bool help = false;
  bool list = false;
  bool markdown = false;
  bool schema = false;
};

int run(const Options& options, const CLI::App& command) {
  if (options.list || options.markdown || options.schema) {
    print(options.list       ? solve::list_of_kinds()
          : options.markdown ? solve::markdown()
                             : solve::json_schema());
    return success;
  }
  if (options.help && options.kind.empty()) {
    print(command.get_parent()->help());  // which names the program, too
    return success;
  }
  if (options.help) {
    if (const auto kind = solve::find_kind(options.kind)) {
      print(solve::help_of(**kind));
      return success;
    }
  }
  if (options.kind.empty()) {
    tell(Error(ArgumentError::empty)
             .in("solve")
             .about("KIND")
             .got("left out")
             .expected("a kind of problem, such as dare")
             .hint("flyball solve --list lists all"));
    return bad_input;
  }
  return answer_all(options.kind);
}

}  // namespace

void add_solve_command(CLI::App& program, Invocation& invocation) {
  CLI::App* command = program.add_subcommand(
      "solve", "Solve a control equation: JSON in, JSON out, one problem a line");
  command->footer(
      "Matrices are lists of rows, complex numbers [re, im], infinities \"inf\" and \"-inf\"; a "
      "field\n"
      "id is echoed.\n"
      "Exit status: 0 all solved, 1 some problem has no solution, 2 some line was no problem.\n"
      "\n  flyball solve --list         every kind of problem\n"
      "  flyball solve dare --help    the fields of one, with an example\n"
      "\n  echo '{\"A\": [[1]], \"B\": [[1]], \"Q\": [[1]], \"R\": [[1]]}' | flyball solve dare");
  auto options = std::make_shared<Options>();
  // The help of a kind is its row's, so that the option is an ordinary one.
  command->set_help_flag();
  command->add_flag("-h,--help", options->help, "Print this help, or with KIND that of the kind");
  command->add_flag("--list", options->list, "Print every kind of problem and what it solves");
  command->add_flag("--schema", options->schema,
                    "Print the JSON Schema of all problems and answers");
  command->add_flag("--markdown", options->markdown, "Print docs/solve.md")->group("");
  command->add_option("KIND", options->kind, "Which kind of problem");
  command->callback([options, command, &invocation] {
    try {
      invocation.status = run(*options, *command);
    } catch (const std::bad_alloc&) {  // while reading; a problem is answered where it is solved
      invocation.status = refuse(not_enough_memory("standard input"));
    }
  });
}

}  // namespace flyball::app
