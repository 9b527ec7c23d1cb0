! SPDX-License-Identifier: MIT
!> What a new run writes about itself into results and checkpoints.
module rockdda_run_results_head
   use rockdda_base_kinds, only : wp
   use rockdda_base_strings, only : as_utf8
   use rockdda_base_version, only : version
   use rockdda_model_options, only : is_set
   use rockdda_model_stage_options, only : stage_names, water_of_stages
   use rockdda_stepping_simulation, only : simulation_type
   use rockdda_io_checkpoint, only : checkpoint_facts_type
   use rockdda_io_results_header, only : results_header_type
   use rockdda_io_timestamp, only : utc_now
   use rockdda_run_input, only : model_input_type
   implicit none
   private
   public :: start_facts, describe_run

   !> Longest time between flushes of the results, whatever the options [s].
   real(wp), parameter :: longest_flush_interval = 2
   !> Default time between checkpoints [s].
   real(wp), parameter :: usual_checkpoint_interval = 60

contains

   !> Facts of a run that begins, with the header of its results.
   subroutine start_facts(input, sim, facts)
      type(model_input_type), intent(in) :: input
      type(simulation_type), intent(in) :: sim             !! at time 0
      type(checkpoint_facts_type), intent(inout) :: facts
      facts%model_file = input%model_file
      facts%analysis_file = input%analysis_file
      facts%config_file = input%config_file
      if (is_set(input%options%threads)) facts%threads = input%options%threads
      facts%checkpoint_every = usual_checkpoint_interval
      if (is_set(input%options%checkpoint_every)) facts%checkpoint_every = input%options%checkpoint_every
      associate (header => facts%header)
         header%title = as_utf8(input%parameters%title)
         header%program_version = version
         header%created = utc_now()
         header%geometry = input%model_text
         header%analysis = input%analysis_text
         header%config = input%config_text
         header%frames = input%options%write_frames
         header%contacts = input%options%write_contacts
         call sim%list_boundaries(header%n_boundaries, header%boundary_edges, header%boundary_kinds)
         call sim%list_water(header%water_edges, header%water_ends)
         header%water = sim%parameters%water
         header%stage_water = water_of_stages(input%parameters%stages)
      end associate
      call describe_run(sim, facts%checkpoint_every, facts%header)
   end subroutine start_facts

   !> What of the header follows from the run, and is not kept in checkpoints.
   subroutine describe_run(sim, checkpoint_every, header)
      type(simulation_type), intent(in) :: sim
      real(wp), intent(in) :: checkpoint_every             !! [s]
      type(results_header_type), intent(inout) :: header
      header%flush_interval = min(longest_flush_interval, checkpoint_every)
      header%single = sim%parameters%single_frames
      header%units = sim%parameters%units
      header%n_boundaries = size(sim%parameters%boundaries)
      call sim%list_bolts(header%n_bolt_nodes, header%bolt_names, header%bolt_first, header%bolt_spacing)
      call sim%list_liners(header%n_liner_nodes, header%liner_names, header%liner_first, header%liner_section)
      header%stage_names = stage_names(sim%parameters%stages, sim%parameters%ends_with_stages)
      allocate (header%stage_resets(size(header%stage_names)), source=0)
      associate (stages => sim%parameters%stages)
         header%stage_resets(:size(stages)) = merge(1, 0, stages%reset_displacement)
      end associate
   end subroutine describe_run

end module rockdda_run_results_head
