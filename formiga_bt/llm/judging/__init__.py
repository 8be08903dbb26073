"""What an answer is worth: checker, dry run, comparison with the request; and whether a refusal or a question may stand."""
