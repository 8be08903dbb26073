"""The static checks of a whole task, on its model: what no single step or name shows by itself. `whole` is the door.

What is wrong with one step or one name is reported where that is read (`steps`, `roles`, ...); here is what needs
the steps around it. `flight`, `flying`, `sky`, `machines`, `renaming` and `agreeing` follow who is in the air; `sense` and
what it calls ask whether a task does what its author means; each other module is one check, with its codes at the head of
the file.

To add a check:

1. Take the next free code: `E` if the task cannot run as written, `W` if it can, though hardly as it is meant.
2. Write a module with one function `check_...(task, catalogue, problems)` that walks the model (`lang.walk`, `bodies`) and
   reports with `problems.add(code, mark, what is wrong, how to mend it, fix)`. A fix is applied by `formiga fix`.
3. Call it in `whole.check_task`, or in `sense.check_sense` if it only warns about tasks without an error.
4. Describe the code in `docs/errors.md`: one row of the table and one page.
5. Pin its words: a task in `tests/lang_errors/` with its `.expected.txt`, and a task beside it that must stay silent.

`tests/repo` and `tests/unit/lang/test_lang_errors.py` fail while 4 or 5 is missing.
"""
