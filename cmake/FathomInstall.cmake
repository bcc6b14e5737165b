# Install rules are completed by the packaging work.
