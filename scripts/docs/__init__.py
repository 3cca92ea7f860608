"""The documentation as a site: pages made from the program, their theme."""
