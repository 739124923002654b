% Octave's side of compare.py: reads the file of problems named on the command line, one JSON object
% a line, and answers each with the smallest time of a whole call in microseconds.
pkg load control
file = fopen (argv (){1});
while (ischar (line = fgetl (file)))
  p = jsondecode (line);
  switch (p.kind)
    case "dare"
      work = @() dare (p.A, p.B, p.Q, p.R);
    case "care"
      work = @() care (p.A, p.B, p.Q, p.R);
    case "lyapunov"
      work = @() lyap (p.A, p.Q);
    case "discrete-lyapunov"
      work = @() dlyap (p.A, p.Q);
    case "expm"
      work = @() expm (p.A);
  endswitch
  best = Inf;
  started = tic;
  calls = 0;
  while (calls < 5 || toc (started) < 0.06)
    start = tic;
    work ();
    best = min (best, toc (start));
    calls++;
  endwhile
  printf ("%.3f\n", best * 1e6);
endwhile
