"""What this program costs and how exact it is: steps timed, settings compared."""
